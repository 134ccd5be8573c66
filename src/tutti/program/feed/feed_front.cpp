// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_front.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <utility>

#include "tutti/model/relative_pose.hpp"
#include "tutti/robot/odometry_sample.hpp"

namespace tutti::program {
namespace {

/// One sample with the motion of both. Both were taken, so both are usable.
OdometrySample joined(const OdometrySample& first, const OdometrySample& second) {
  const auto usable = [](const OdometrySample& sample) { return robot::usable_step({}, sample).value(); };
  return {second.stamp, second.T_odom_body, robot::joined(usable(first), usable(second)).covariance};
}

}  // namespace

Timestamp stamp_of(const FeedInput& input) {
  const auto* of_robot = std::get_if<Input>(&input);
  return of_robot == nullptr ? Timestamp{} : stamp_of(*of_robot);
}

FeedFront::FeedFront(FeedState robot, const Limits& limits)
    : limits_(limits),
      robot_(std::move(robot)),
      gate_(robot_.chain.robot, robot_.newest ? std::optional(robot_.newest->stamp) : std::nullopt),
      carried_(robot_.chain.robot) {
  if (robot_.newest) stored_ = robot_.newest->stamp;
  carried_.correct(robot_.watch, robot_.covariance);
}

Status FeedFront::add(Input input) {
  const std::scoped_lock lock(mutex_);
  if (closed_ && !std::holds_alternative<Health>(input)) return fail(ErrorCode::io, "the robot's program ends");
  Status taken = std::visit([this](auto& sample) { return hear(sample); }, input);
  fed_.notify_one();
  return taken;
}

Status FeedFront::hear(OdometrySample& sample) {
  auto passed = gate_.take(sample);
  if (!passed) return tl::unexpected(passed.error());
  if (!passed->why_anew.empty()) begin_anew(std::move(passed->why_anew));
  if (passed->waited)
    if (Status ok = take(*passed->waited); !ok) return ok;
  if (Status ok = take(sample); !ok) return ok;
  if (due() > limits_.inputs) {
    note_behind(sample.stamp);
    thin();
  }
  return {};
}

Status FeedFront::take(const OdometrySample& sample) {
  const auto has_jumped = carried_.add(sample);
  if (!has_jumped) return tl::unexpected(has_jumped.error());
  if (*has_jumped) jumps_.insert(sample.stamp);
  ended_ = false;
  push(sample);
  release();
  return {};
}

/// Until the robot has begun its new session, nothing that it reports is about what is fed now.
void FeedFront::begin_anew(std::string why) {
  release(true);
  push(FeedAnew{std::move(why)});
  ++anew_;
  newest_ = {};
  imu_.clear();
  FeedState anew;
  anew.chain = robot_.chain;
  anew.name = robot_.name;
  anew.next_keyframe = robot_.next_keyframe;
  anew.next_keyframe.last.reset();
  robot_ = std::move(anew);
  carried_ = CarriedPose(robot_.chain.robot);
  carried_.correct(robot_.watch, robot_.covariance);
}

Status FeedFront::finish() {
  const std::scoped_lock lock(mutex_);
  if (closed_) return fail(ErrorCode::io, "the robot's program ends");
  release(true);
  push(FeedEnded{});
  fed_.notify_one();
  return {};
}

void FeedFront::note_behind(Timestamp stamp) {
  const Load now{0, left_out_[index_of<Scan>()], samples_joined_, left_out_[index_of<EncodedImages>()]};
  if (now == Load{}) behind_since_ = stamp;
}

/// Adds what is due, before what is held. Two samples that are closer than finest_s_ become one, as in
/// SensorTimeline::add(); never across a jump.
void FeedFront::push_back(Queued input) {
  const auto at = inputs_.end() - static_cast<std::ptrdiff_t>(held_);
  const auto* sample = sample_in<OdometrySample>(*input);
  if (sample != nullptr && due() >= 2) {
    const auto* last = sample_in<OdometrySample>(**std::prev(at));
    const auto* before = sample_in<OdometrySample>(**std::prev(at, 2));
    const auto jumps = [&](const OdometrySample& one) { return jumps_.contains(one.stamp); };
    if (last != nullptr && before != nullptr && sample->stamp - before->stamp < finest_s_ && !jumps(*last) &&
        !jumps(*sample)) {
      *std::prev(at) = std::make_shared<const FeedInput>(joined(*last, *sample));
      ++samples_joined_;
      return;
    }
  }
  inputs_.insert(at, std::move(input));
}

/// Drops waiting odometry samples until a quarter of the room is free. Those that stay are evenly spaced, so that the
/// trajectory stays as fine as the room allows. There is always odometry to drop: scans may take half of the room.
void FeedFront::thin() {
  double span_s = 0.0;
  std::size_t first = inputs_.size();  // where the odometry of a session begins
  for (std::size_t i = taken_; i < inputs_.size(); ++i) {
    if (std::holds_alternative<FeedAnew>(*inputs_[i])) first = inputs_.size();
    if (!sample_in<OdometrySample>(*inputs_[i])) continue;
    first = std::min(first, i);
    span_s = std::max(span_s, stamp_of(*inputs_[i]) - stamp_of(*inputs_[first]));
  }
  finest_s_ = std::max(2.0 * finest_s_, 2.0 * span_s / static_cast<double>(limits_.inputs));
  while (due() > limits_.inputs / 4 * 3 && finest_s_ < 4.0 * span_s) {
    const auto begin = inputs_.begin() + static_cast<std::ptrdiff_t>(taken_),
               end = inputs_.end() - static_cast<std::ptrdiff_t>(held_);
    std::vector<Queued> all(std::make_move_iterator(begin), std::make_move_iterator(end));
    inputs_.erase(begin, end);
    for (Queued& input : all) push_back(std::move(input));
    finest_s_ *= 2.0;
  }
}

FeedState FeedFront::state() const {
  const std::scoped_lock lock(mutex_);
  FeedState out = robot_;
  out.newest = carried_.newest();
  out.T_odom_fed = carried_.watch().T_odom_fed();
  if (!(out.T_odom_fed == robot_.T_odom_fed))
    out.T_map_odom = robot_.T_map_odom * robot_.T_odom_fed.inverse() * out.T_odom_fed;
  out.covariance = carried_.covariance();
  out.stored = stored_;
  out.ended = ended_ && is_stored();
  // It would want a scan at samples that it has not heard yet where it wanted one, or where a keyframe is due.
  if (carried_.steps() > 0 || (out.newest && !robot_.newest))
    out.wants_scan =
        robot_.wants_scan || robot_.next_keyframe.is_due({out.newest->stamp, carried_.watch().T_odom_body()});
  if (!trouble_.empty()) out.alerts.push_back({trouble_, trouble_since_, trouble_since_, trouble_since_});
  if (const std::string refused = gate_.trouble(); !refused.empty()) {
    const Timestamp since = carried_.newest() ? carried_.newest()->stamp : Timestamp{};
    out.alerts.push_back({refused, since, since, since});
  }
  const std::size_t scans = left_out_[index_of<Scan>()], images = left_out_[index_of<EncodedImages>()];
  if (scans + samples_joined_ + images > 0) {
    const std::string text = fmt::format("the map is behind what is fed, localisation goes on: {}are left out{}",
                                         images == 0  ? "scans "
                                         : scans == 0 ? "images "
                                                      : "scans and images ",
                                         samples_joined_ > 0 ? ", odometry is taken together" : "");
    out.alerts.push_back({text, behind_since_, behind_since_, behind_since_});
  }
  out.status = status_;
  return out;
}

std::vector<FeedRefusal> FeedFront::take_refusals() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(refusals_, {});
}

void FeedFront::want_trajectory() {
  const std::scoped_lock lock(mutex_);
  wants_trajectory_ = true;
}

bool FeedFront::wants_trajectory() const {
  const std::scoped_lock lock(mutex_);
  return wants_trajectory_;
}

void FeedFront::say(FeedTrajectory trajectory) {
  const std::scoped_lock lock(mutex_);
  trajectories_.push_back(std::move(trajectory));
  if (trajectories_.size() > kTrajectories) trajectories_.pop_front();
}

std::vector<FeedTrajectory> FeedFront::take_trajectories() {
  const std::scoped_lock lock(mutex_);
  std::vector<FeedTrajectory> out(std::make_move_iterator(trajectories_.begin()),
                                  std::make_move_iterator(trajectories_.end()));
  trajectories_.clear();
  return out;
}

std::shared_ptr<const FeedInput> FeedFront::take(double wall_s) {
  std::unique_lock lock(mutex_);
  const auto has_more = [&] { return due() > 0; };
  if (!fed_.wait_for(lock, std::chrono::duration<double>(wall_s), has_more)) return nullptr;
  in_hand_ = true;
  return inputs_[taken_++];
}

void FeedFront::note_heard() {
  const std::scoped_lock lock(mutex_);
  in_hand_ = false;
}

std::shared_ptr<const Sensors> FeedFront::sensors() const {
  const std::scoped_lock lock(mutex_);
  return sensors_;
}

std::vector<ImuSample> FeedFront::imu(Timestamp from, Timestamp until) const {
  const std::scoped_lock lock(mutex_);
  return imu_over(imu_, from, until);
}

bool FeedFront::is_drained() const {
  const std::scoped_lock lock(mutex_);
  return due() == 0;
}

void FeedFront::free_bytes_of(const FeedInput& input) {
  if (const auto* of_robot = std::get_if<Input>(&input)) bytes_[of_robot->index()] -= bytes_of(*of_robot);
}

void FeedFront::note_stored() {
  std::vector<Queued> stored;  // which are freed while nobody waits
  const std::scoped_lock lock(mutex_);
  for (; taken_ > 0; --taken_) {
    const FeedInput& input = *inputs_.front();
    if (!std::holds_alternative<std::shared_ptr<const Sensors>>(input))
      ended_ = std::holds_alternative<FeedEnded>(input);
    if (const auto* sample = sample_in<OdometrySample>(input)) stored_ = sample->stamp;
    if (std::holds_alternative<FeedAnew>(input)) {
      stored_.reset();
      --anew_;
    }
    free_bytes_of(input);
    stored.push_back(std::move(inputs_.front()));
    inputs_.pop_front();
  }
  if (!is_stored()) return;
  left_out_ = {};
  samples_joined_ = 0;
  finest_s_ = 0.0;
  jumps_.clear();
}

void FeedFront::begin_again(const std::optional<Timestamp>& stored) {
  const std::scoped_lock lock(mutex_);
  if (std::exchange(in_hand_, false)) leave_out_what_fails();
  taken_ = 0;
  stored_ = stored;
  bool is_of_robot = true;  // and not of the session that it begins next
  std::erase_if(inputs_, [&](const Queued& input) {
    is_of_robot = is_of_robot && !std::holds_alternative<FeedAnew>(*input);
    const auto* sample = sample_in<OdometrySample>(*input);
    return is_of_robot && sample != nullptr && stored && sample->stamp <= *stored;
  });
}

/// The last one taken made the robot go.
void FeedFront::leave_out_what_fails() {
  const auto input = inputs_.begin() + static_cast<std::ptrdiff_t>(taken_ - 1);
  failures_ = failed_ == *input ? failures_ + 1 : 1;
  failed_ = *input;
  if (failures_ < limits_.tries) return;
  refusals_.push_back({stamp_of(**input), fmt::format("left out: the robot's program failed {} times with it, which is "
                                                      "a defect of it",
                                                      failures_)});
  free_bytes_of(**input);
  inputs_.erase(input);
  failed_.reset();
}

void FeedFront::refuse(Timestamp stamp, std::string why) {
  const std::scoped_lock lock(mutex_);
  refusals_.push_back({stamp, std::move(why)});
}

void FeedFront::publish(FeedState robot) {
  const std::scoped_lock lock(mutex_);
  if (anew_ > 0) return;
  const bool is_same = robot.chain == robot_.chain;
  // One that was made again reports nothing until it has caught up.
  if (is_same && robot_.newest && (!robot.newest || robot.newest->stamp < robot_.newest->stamp)) return;
  robot_ = std::move(robot);
  carried_.correct(robot_.watch, robot_.covariance);
}

void FeedFront::say_trouble(std::string trouble) {
  const std::scoped_lock lock(mutex_);
  if (trouble_.empty() && carried_.newest()) trouble_since_ = carried_.newest()->stamp;
  trouble_ = std::move(trouble);
}

std::string FeedFront::odometry_trouble() const {
  const std::scoped_lock lock(mutex_);
  return gate_.trouble();
}

void FeedFront::close() {
  const std::scoped_lock lock(mutex_);
  closed_ = true;
}

bool FeedFront::has_ended() const {
  const std::scoped_lock lock(mutex_);
  return ended_ && is_stored();
}

FeedFront::Load FeedFront::load() const {
  const std::scoped_lock lock(mutex_);
  return {due(), left_out_[index_of<Scan>()], samples_joined_, left_out_[index_of<EncodedImages>()]};
}

bool FeedFront::is_filling() const {
  const std::scoped_lock lock(mutex_);
  return inputs_.size() > limits_.inputs / 4 || bytes_[index_of<Scan>()] > limits_.scan_bytes / 4 ||
         bytes_[index_of<EncodedImages>()] > limits_.image_bytes / 4;
}

FeedFront::Figures FeedFront::figures() const {
  const std::scoped_lock lock(mutex_);
  constexpr std::size_t kImages = index_of<EncodedImages>(), kImu = index_of<ImuSamples>(),
                        kFixes = index_of<PositionFix>();
  return {heard_[kImages], refused_[kImages], heard_[kImu],   refused_[kImu],
          heard_[kFixes],  refused_[kFixes],  bytes_[kImages]};
}

}  // namespace tutti::program
