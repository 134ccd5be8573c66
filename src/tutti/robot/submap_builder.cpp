// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/submap_builder.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "tutti/geometry/so3.hpp"
#include "tutti/model/path_length.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/perception/lidar/undistort.hpp"
#include "tutti/robot/odometry_sample.hpp"

namespace tutti::robot {
namespace {

const std::string kTooFarApart = fmt::format("expected at most {} s between them", SubmapBuilder::kLongestGap_s);
const std::string kAcrossJump = "across which odometry jumps";

}  // namespace

SubmapBuilder::SubmapBuilder(const ChainId& chain, const SubmapConfig& config, SubmapBuilderState state)
    : chain_(chain), config_(config), state_(std::move(state)) {}

NextKeyframe SubmapBuilder::next_keyframe() const {
  NextKeyframe next{.last = {},
                    .distance_m = config_.keyframe_distance_m,
                    .angle_rad = config_.keyframe_angle_deg * kRadPerDeg,
                    .time_s = config_.keyframe_time_s};
  if (!state_.keyframes.empty()) next.last = {state_.keyframes.back().stamp, state_.keyframes.back().T_odom_body};
  return next;
}

bool SubmapBuilder::is_keyframe(Timestamp stamp, const Pose3& T_odom_body) const {
  return next_keyframe().is_due({stamp, T_odom_body});
}

/// Keeps what is newer than the history, and one sample before it; of samples that are close together, fewer.
void SubmapBuilder::remember(Timestamp stamp, const Pose3& T_odom_body) {
  Trajectory& recent = state_.recent;
  const bool is_close = recent.size() >= 2 && stamp - recent[recent.size() - 2].stamp < SensorTimeline::kFinest_s;
  if (is_close)
    recent.back() = {stamp, T_odom_body};
  else
    recent.push_back({stamp, T_odom_body});
  std::ptrdiff_t old = 0;
  while (old + 1 < std::ssize(recent) && stamp - recent[static_cast<std::size_t>(old + 1)].stamp >= kHistory_s) ++old;
  recent.erase(recent.begin(), recent.begin() + old);
}

std::optional<Timestamp> SubmapBuilder::newest_sample() const {
  if (!state_.waiting.odometry.empty()) return state_.waiting.odometry.back().stamp;
  return state_.recent.empty() ? std::nullopt : std::optional(state_.recent.back().stamp);
}

std::optional<Timestamp> SubmapBuilder::settled() const {
  return state_.recent.empty() ? std::nullopt : std::optional(state_.recent.back().stamp);
}

RelativePose SubmapBuilder::since_keyframe() const {
  RelativePose since = state_.since_keyframe;
  const Pose3* last = state_.recent.empty() ? nullptr : &state_.recent.back().pose;
  for (const OdometryStep& step : state_.waiting.odometry) {
    since = compound(since, {last->inverse() * step.T_odom_body, step.covariance});
    last = &step.T_odom_body;
  }
  return since;
}

/// Drops sensor data of times for which the robot's pose is unknown.
void SubmapBuilder::drop_between(Timestamp before, Timestamp after, const std::string& why) {
  std::erase_if(state_.waiting.sensors, [&](const SensorSample& sample) {
    const bool is_between = sample.stamp > before && sample.stamp < after;
    if (is_between && sample.scan)
      scan_errors_.push_back(
          {ErrorCode::invalid, fmt::format("robot {}: scan at {} ns is between odometry at {} and {} ns, {}",
                                           chain_.robot.value, sample.stamp.ns, before.ns, after.ns, why)});
    return is_between;
  });
  const auto is_between = [&](const auto& sample) { return sample.stamp > before && sample.stamp < after; };
  std::erase_if(state_.waiting_fixes, is_between);
  std::erase_if(state_.ranges, is_between);
}

Status SubmapBuilder::add(const Input& input) {
  const InputKind& kind = kind_of(input);
  if (kind.needs == Needs::odometry)
    if (Status ok = check_time(stamp_of(input), kind); !ok) return ok;
  return std::visit([this](const auto& sample) { return hear(sample); }, input);
}

Status SubmapBuilder::add(const OdometryStep& step) {
  if (auto ok = check_step(chain_.robot, step); !ok) return ok;
  const auto newest = newest_sample();
  if (!newest) {
    take({step, std::nullopt});
    return {};
  }
  if (auto ok = check_follows(chain_.robot, step.stamp, newest); !ok) return ok;
  if (step.is_jump || step.stamp - *newest > kLongestGap_s)
    drop_between(*newest, step.stamp, step.is_jump ? kAcrossJump : kTooFarApart);
  state_.waiting.add(step);
  advance();
  return {};
}

/// Hands on what nothing can come before any more.
void SubmapBuilder::advance() {
  const std::optional<Timestamp> newest = newest_sample();
  if (!newest) return;
  Timestamp until = *newest;
  if (has_scans() || has_images()) {
    until = until - waiting::kLate_s;
    const std::optional<Timestamp>& heard = has_images() ? state_.heard_images : state_.heard_scan;
    if (heard) until = std::max(until, *heard);
  }
  while (auto instant = state_.waiting.take(state_.recent.back(), until)) take(std::move(*instant));
}

bool SubmapBuilder::makes_keyframe(const SensorTimeline::Instant& instant) {
  const OdometryStep& step = instant.step;
  const bool has_sensors = has_scans() || has_images();
  const bool is_waited_for = instant.sensors && (instant.sensors->images || !instant.sensors->scan || !has_images());
  if (is_waited_for) state_.is_blind = false;
  if (!is_keyframe(step.stamp, step.T_odom_body)) return false;
  if (state_.keyframes.empty() || !has_sensors || is_waited_for || state_.is_blind) return true;
  if (!state_.due) state_.due = step.stamp;
  state_.is_blind = step.stamp - *state_.due >= waiting::kSilent_s;
  return state_.is_blind;
}

/// The submap that is open ends at the last sample, the next one goes from there to this one.
void SubmapBuilder::take_jump(const OdometryStep& jump) {
  const StampedPose last = state_.recent.back();
  const auto end_submap = [&] {
    if (state_.keyframes.size() > 1) change_submap();
    if (!state_.finished.empty()) state_.finished.back().awaits_images = false;
  };
  if (state_.keyframes.back().stamp != last.stamp) add_keyframe(last.stamp, last.pose);
  end_submap();
  state_.scans.clear();
  state_.images.clear();
  state_.since_keyframe = {last.pose.inverse() * jump.T_odom_body, jump.covariance};
  add_keyframe(jump.stamp, jump.T_odom_body);
  end_submap();
  state_.recent = {{jump.stamp, jump.T_odom_body}};
}

void SubmapBuilder::take(SensorTimeline::Instant instant) {
  const auto& [stamp, T_odom_body, covariance, is_jump] = instant.step;
  if (is_jump) {
    take_jump(instant.step);
  } else {
    if (!state_.recent.empty()) {
      const Pose3 step = state_.recent.back().pose.inverse() * T_odom_body;
      state_.distance_m += step.translation.norm();
      state_.since_keyframe = compound(state_.since_keyframe, {step, covariance});
    }
    remember(stamp, T_odom_body);
    place_fixes();
    if (!state_.finished.empty()) state_.finished.back().awaits_images = false;
    if (makes_keyframe(instant)) add_keyframe(stamp, T_odom_body);
  }
  if (!instant.sensors) return;
  auto& [at, scan, images] = *instant.sensors;
  if (images && state_.keyframes.back().stamp == stamp) keep(*images);
  if (!scan || state_.keyframes_without_scan == 0) return;
  if (const auto undistorted_scan = undistorted(*scan))
    merge(*undistorted_scan, T_odom_body);
  else
    scan_errors_.push_back(undistorted_scan.error());
}

void SubmapBuilder::add_keyframe(Timestamp stamp, const Pose3& T_odom_body) {
  const bool first = state_.keyframes.empty();
  Keyframe keyframe{first ? 0 : state_.keyframes.back().index + 1, stamp, T_odom_body};
  if (first || state_.distance_m - state_.representative_distance_m >= config_.representative_distance_m) {
    keyframe.representative = true;
    state_.representative_distance_m = state_.distance_m;
  }
  state_.due.reset();
  ++state_.keyframes_without_scan;
  ++state_.keyframes_without_images;
  const std::uint32_t submap = state_.next_submap;
  if (first) {
    start_submap(keyframe);
    keyframes_.push_back({KeyframeStep{keyframe}, submap});
    return;
  }
  const KeyframeStep step{keyframe, std::exchange(state_.since_keyframe, KeyframeStep{}.odometry)};
  keyframes_.push_back({step, submap});
  state_.keyframes.push_back(keyframe);
  state_.odometry.push_back(step.odometry);
  if (is_full()) change_submap();
}

bool SubmapBuilder::is_due_at(Timestamp stamp) const {
  const auto T_odom_body = state_.waiting.pose_at(state_.recent.back(), stamp);
  return T_odom_body && is_keyframe(stamp, *T_odom_body);
}

bool SubmapBuilder::wants_scan(Timestamp stamp) const {
  if (state_.recent.empty() || stamp < state_.recent.front().stamp) return true;  // it is refused
  if (state_.heard_scan && stamp <= *state_.heard_scan) return false;
  if (!has_scans() || stamp > *newest_sample() || state_.keyframes_without_scan > 0) return true;
  return stamp > state_.recent.back().stamp && is_due_at(stamp);
}

bool SubmapBuilder::wants_scan() const {
  const auto newest = newest_sample();
  if (!newest) return false;
  if (has_scans()) return wants_scan(*newest);
  return state_.keyframes.back().stamp == *newest || is_due_at(*newest);
}

bool SubmapBuilder::wants_images(Timestamp stamp) const {
  if (state_.recent.empty() || (state_.heard_images && stamp <= *state_.heard_images)) return false;
  if (stamp > *newest_sample()) return true;
  if (stamp > state_.recent.back().stamp) return is_due_at(stamp);
  return stamp == state_.recent.back().stamp && stamp == state_.keyframes.back().stamp;
}

/// Whether odometry covers this time, or will.
Status SubmapBuilder::check_time(Timestamp stamp, const InputKind& kind) const {
  const auto newest = newest_sample();
  if (!newest || stamp - *newest > kind.ahead_s)
    return fail(ErrorCode::invalid, "robot {}: {} at {} ns, no odometry within {} s before (latest: {} ns)",
                chain_.robot.value, kind.name, stamp.ns, kind.ahead_s, newest ? newest->ns : 0);
  if (stamp < state_.recent.front().stamp)
    return fail(ErrorCode::invalid,
                "robot {}: {} at {} ns, no odometry is kept of that time (from {} ns on, latest: "
                "{} ns): too late, or its clock is another one",
                chain_.robot.value, kind.name, stamp.ns, state_.recent.front().stamp.ns, newest->ns);
  const std::deque<OdometryStep>& waiting = state_.waiting.odometry;
  const auto after = std::ranges::lower_bound(waiting, stamp, {}, &OdometryStep::stamp);
  if (after == waiting.end() || stamp <= state_.recent.back().stamp) return {};
  const Timestamp before = after == waiting.begin() ? state_.recent.back().stamp : std::prev(after)->stamp;
  if (after->stamp != stamp && (after->is_jump || after->stamp - before > kLongestGap_s))
    return fail(ErrorCode::invalid, "robot {}: {} at {} ns is between odometry at {} and {} ns, {}", chain_.robot.value,
                kind.name, stamp.ns, before.ns, after->stamp.ns, after->is_jump ? kAcrossJump : kTooFarApart);
  return {};
}

Result<Scan> SubmapBuilder::undistorted(const Scan& scan) const {
  Trajectory samples = state_.recent;
  for (const OdometryStep& step : state_.waiting.odometry) {
    if (step.is_jump && step.stamp <= scan.stamp) samples.clear();  // what was seen before is somewhere else
    samples.push_back({step.stamp, step.T_odom_body});
  }
  auto out = lidar::undistort(scan, samples);
  if (!out) return fail(ErrorCode::invalid, "robot {}: {}", chain_.robot.value, out.error().message);
  return out;
}

void SubmapBuilder::merge(const Scan& scan, const Pose3& T_odom_body) {
  state_.scans.push_back({scan.stamp, state_.keyframes.front().T_odom_body.inverse() * T_odom_body, scan.cloud});
  state_.keyframes_without_scan = 0;
  const bool is_shared = state_.keyframes.size() == 1 && scan.stamp == state_.keyframes.front().stamp;
  if (!is_shared || state_.finished.empty() || config_.fit.scans == "off") return;
  FinishedSubmap& before = state_.finished.back();
  before.scan_after = {scan.stamp, before.submap.keyframes.front().T_odom_body.inverse() * T_odom_body, scan.cloud};
}

Status SubmapBuilder::hear(const Scan& scan) {
  if (!scan.cloud || scan.cloud->points.empty())
    return fail(ErrorCode::invalid, "robot {}: scan at {} ns is empty", chain_.robot.value, scan.stamp.ns);
  if (!wants_scan(scan.stamp)) return {};
  const bool is_ahead = scan.stamp > *newest_sample();
  auto usable = is_ahead ? Result<Scan>(scan) : undistorted(scan);
  if (!usable) return tl::unexpected(usable.error());
  state_.heard_scan = scan.stamp;
  if (scan.stamp <= state_.recent.back().stamp) {
    if (state_.keyframes_without_scan > 0) merge(*usable, *pose_at(state_.recent, scan.stamp));
    return {};
  }
  state_.waiting.add(SensorSample{scan.stamp, std::move(*usable), std::nullopt});
  advance();
  return {};
}

void SubmapBuilder::keep(const TrackedImages& images) {
  state_.images.push_back(images);
  state_.keyframes_without_images = 0;
  // The keyframe that two submaps share shows both the same.
  if (!state_.finished.empty() && state_.finished.back().awaits_images) {
    state_.finished.back().images.push_back(images);
    state_.finished.back().awaits_images = false;
  }
}

Status SubmapBuilder::hear(const TrackedImages& images) {
  const auto where = [&] { return fmt::format("robot {}: images at {} ns", chain_.robot.value, images.stamp.ns); };
  if (auto ok = check_images(images); !ok) return in_context(where(), ok.error());
  if (!state_.images.empty() && *state_.images.back().cameras != *images.cameras)
    return fail(ErrorCode::invalid, "{}: other cameras than those of the images before", where());
  if (state_.heard_images && images.stamp <= *state_.heard_images)
    return fail(ErrorCode::invalid, "{}: there are some of {} ns already", where(), state_.heard_images->ns);
  if (!wants_images(images.stamp))
    return fail(ErrorCode::invalid, "{}: no keyframe has their stamp (latest sample: {} ns, settled: {} ns)", where(),
                newest_sample()->ns, state_.recent.back().stamp.ns);
  state_.heard_images = images.stamp;
  if (images.stamp == state_.recent.back().stamp) {
    keep(images);
    return {};
  }
  state_.waiting.add(SensorSample{images.stamp, std::nullopt, images});
  advance();
  return {};
}

void SubmapBuilder::add_keyframe_time(Timestamp stamp) {
  if (!check_time(stamp, {"keyframe", Needs::odometry}) || stamp <= state_.recent.back().stamp) return;
  if (has_scans()) state_.heard_scan = stamp;
  if (has_images()) state_.heard_images = stamp;
  state_.waiting.add(SensorSample{stamp, std::nullopt, std::nullopt});
  advance();
}

void SubmapBuilder::start_submap(const Keyframe& first) {
  state_.keyframes = {first};
  state_.odometry.clear();
  state_.scans.clear();
  state_.images.clear();
}

/// Travel is counted between keyframes: from sample to sample, noise alone would add up to metres.
bool SubmapBuilder::is_full() const {
  return state_.keyframes.back().stamp - state_.keyframes.front().stamp >= config_.duration_s ||
         path_length_m(state_.odometry) >= config_.distance_m;
}

void SubmapBuilder::close_submap() {
  Submap submap{
      {chain_, state_.next_submap++}, state_.keyframes, state_.odometry, take_fixes(), take_ranges(), nullptr, nullptr};
  state_.finished.push_back(
      {.submap = std::move(submap), .scans = std::move(state_.scans), .images = std::move(state_.images)});
}

void SubmapBuilder::change_submap() {
  const Keyframe shared = state_.keyframes.back();
  close_submap();
  state_.finished.back().awaits_images = !state_.finished.back().images.empty();
  start_submap(shared);
}

void SubmapBuilder::finish() {
  if (state_.recent.empty()) return;
  while (auto instant = state_.waiting.take(state_.recent.back(), Timestamp{std::numeric_limits<std::int64_t>::max()}))
    take(std::move(*instant));
  if (state_.keyframes.size() < 2) return;
  close_submap();
  start_submap(state_.keyframes.back());
}

}  // namespace tutti::robot
