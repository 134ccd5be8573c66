// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/intake/ros_intake.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/bags/point_cloud.hpp"
#include "tutti/base/plain_text.hpp"
#include "tutti/perception/lidar/deskewed_scan.hpp"

namespace tutti::intake {
namespace {

constexpr double kUnseen_m2 = 1.0, kUnseen_rad2 = 0.03;  // as ros2/tutti_ros states it

Matrix6d unseen() {
  return (Vector6d() << Eigen::Vector3d::Constant(kUnseen_m2), Eigen::Vector3d::Constant(kUnseen_rad2))
      .finished()
      .asDiagonal();
}

/// Names are anybody's, and go to a terminal.
std::string plain(const std::string& name) { return plain_text(name, 80); }

std::string source_of(const bags::AntennaSample& sample) {
  return sample.range() == nullptr ? std::string() : sample.range()->name;
}

using Verdict = robot::StampWatch::Verdict;

Status check_increases(Timestamp stamp, const std::optional<Timestamp>& before) {
  if (!before || stamp > *before) return {};
  return fail(ErrorCode::invalid, "stamp {} ns, expected after {} ns: two publishers, or a clock that began anew?",
              stamp.ns, before->ns);
}

}  // namespace

void RosIntake::begin_behind(const std::optional<Timestamp>& newest) {
  known_ = newest;
  if (!stamps_.newest()) stamps_ = robot::StampWatch(newest);
  unseen_ = newest && (!last_ || last_->stamp != *newest);
  if (newest) std::erase_if(samples_, [&](const StampedPose& sample) { return sample.stamp <= *newest; });
}

Status RosIntake::counted(Status taken) {
  if (!taken) ++counts_.refused;
  return taken;
}

Status RosIntake::add_odometry(std::string_view bytes, Encoding encoding) {
  return counted(take_odometry(bytes, encoding));
}
Status RosIntake::add_points(std::string_view bytes, std::string_view type, Encoding encoding) {
  return counted(take_points(bytes, type, encoding));
}
Status RosIntake::add_antenna(std::string_view topic, std::string_view type, std::string_view bytes,
                              Encoding encoding) {
  return counted(take_antenna(topic, type, bytes, encoding));
}

Status RosIntake::take_odometry(std::string_view bytes, Encoding encoding) {
  const auto message = bags::decode_odometry(bytes, encoding);
  if (!message) return tl::unexpected(message.error());
  const auto pose = bags::to_pose(message->pose.position, message->pose.orientation);
  if (!pose) return tl::unexpected(pose.error());
  return add_sample(message->header.stamp, *pose, message->header.frame_id,
                    config_.body_frame.empty() ? message->child_frame_id : config_.body_frame);
}

Status RosIntake::add_sample(Timestamp stamp, const Pose3& T_odom_body, const std::string& odom,
                             const std::string& body) {
  const OdometryFrames stated{bags::frame_name(odom), bags::frame_name(body)};
  if (!frames_) frames_ = stated;
  if (stated.odom != frames_->odom || stated.body != frames_->body)
    return fail(ErrorCode::invalid,
                "frames '{}' -> '{}', expected '{}' -> '{}' as of the first message: two publishers?",
                plain(stated.odom), plain(stated.body), plain(frames_->odom), plain(frames_->body));
  const std::optional<Timestamp> newest = stamps_.newest();
  const bool is_said_again = !config_.odometry_frames.empty() && newest && stamp == *newest;  // as many do on /tf
  if (is_said_again) return {};
  const StampedPose sample{stamp, T_odom_body};
  if (is_history(sample)) return {};
  switch (stamps_.take(stamp)) {
    case Verdict::waits:
    case Verdict::is_before:
      refused_.push_back(sample);
      if (refused_.size() > kMostRefused) refused_.pop_front();
      if (known_ && newest == known_ && stamp <= *known_) return {};  // the robot has it
      if (stamp > *newest)
        return fail(ErrorCode::invalid, "stamp {} ns is {:.0f} s ahead of {} ns: it counts if the next one confirms it",
                    stamp.ns, stamp - *newest, newest->ns);
      return check_increases(stamp, newest);
    case Verdict::confirms:
      queue(refused_.back());
      break;
    case Verdict::begins_anew:
      begin_anew();
      break;
    case Verdict::follows:
      break;
  }
  refused_.clear();
  queue(sample);
  return {};
}

/// A sample that the robot has and who feeds sends again, before anything new: the motion to the next is known then.
bool RosIntake::is_history(const StampedPose& sample) {
  const bool is_again = known_ && counts_.odometry == 0 && sample.stamp <= *known_ &&
                        *known_ - sample.stamp <= kHistory_s &&
                        (history_.empty() || history_.back().stamp < sample.stamp);
  if (!is_again) return false;
  has_whole_history_ = false;
  history_.push_back(sample);
  if (sample.stamp != *known_) return true;
  last_ = sample;
  unseen_ = false;
  return true;
}

void RosIntake::queue(const StampedPose& sample) {
  samples_.push_back(sample);
  missed_.note(sample.stamp);
  counts_.missed = missed_.count();
  ++counts_.odometry;
}

/// The robot judges as stamps_ does, and must see the same row of samples.
void RosIntake::begin_anew() {
  auto first = std::prev(refused_.end());
  while (first != refused_.begin() && std::prev(first)->stamp < first->stamp) --first;
  std::for_each(first, refused_.end(), [&](const StampedPose& sample) { queue(sample); });
  known_.reset();
  scans_.clear();
  held_since_.reset();
  antennas_.clear();
}

Status RosIntake::add_tf(std::string_view bytes, bool is_static, TfOf of, Encoding encoding) {
  const auto transforms = bags::decode_tf(bytes, encoding);
  if (!transforms) return counted(tl::unexpected(transforms.error()));
  Status first;
  for (const bags::RosTransform& transform : *transforms)
    if (Status ok = take_transform(transform, is_static, of); !ok) {
      ++counts_.refused;
      if (first) first = std::move(ok);
    }
  return first;
}

Status RosIntake::take_transform(const bags::RosTransform& transform, bool is_static, TfOf of) {
  const std::string parent = bags::frame_name(transform.header.frame_id),
                    child = bags::frame_name(transform.child_frame_id);
  if (!config_.odometry_frames.empty() && !is_static && parent + "->" + child == config_.odometry_frames) {
    if (of == TfOf::all && has_own_odometry_) return {};  // another robot's, by the same names
    has_own_odometry_ = of == TfOf::robot;
    const auto pose = bags::to_pose(transform.translation, transform.rotation);
    if (!pose) return tl::unexpected(pose.error());
    return add_sample(transform.header.stamp, *pose, parent, child);
  }
  std::set<std::string>& known = of == TfOf::robot ? own_frames_ : known_frames_;
  if (!known.contains(child) && known.size() >= kMostFrames)
    return fail(ErrorCode::invalid, "frame '{}' is one more than {}", plain(child), kMostFrames);
  known.insert(child);
  return (of == TfOf::robot ? own_tree_ : tree_).add(transform, is_static);
}

/// As from a bag of several robots (mission/bag_index.hpp): what is not in the own tree is looked up in that of all.
bags::TransformTree RosIntake::tree() const {
  bags::TransformTree out = own_tree_;
  out.merge(tree_);
  return out;
}

Status RosIntake::check_stamp(Timestamp stamp, const std::optional<Timestamp>& before) const {
  if (Status ok = bags::check_clock(stamp, stamps_.newest()); !ok) return ok;
  return check_follows(stamp, before);
}

Status RosIntake::check_follows(Timestamp stamp, const std::optional<Timestamp>& before) const {
  const std::optional<Timestamp>& newest = stamps_.newest();
  const bool was_wrong = before && newest && *before - *newest > waiting::kAhead_s;
  return was_wrong ? Status() : check_increases(stamp, before);
}

Status RosIntake::take_antenna(std::string_view topic, std::string_view type, std::string_view bytes,
                               Encoding encoding) {
  auto sample = bags::read_antenna_sample(topic, type, bytes, encoding);
  if (!sample) return tl::unexpected(sample.error());
  if (!*sample || (known_ && (*sample)->stamp() <= *known_)) return {};
  const Timestamp stamp = (*sample)->stamp();
  const std::string source = source_of(**sample);
  const auto known = newest_antenna_.find(source);
  const auto newest = known == newest_antenna_.end() ? std::nullopt : std::optional(known->second);
  if (Status ok = check_stamp(stamp, newest); !ok) return ok;
  if (newest && *newest >= stamp)
    std::erase_if(antennas_,
                  [&](const auto& waiting) { return waiting.stamp() >= stamp && source_of(waiting) == source; });
  if (!newest && newest_antenna_.size() >= kMostAntennas) newest_antenna_.clear();  // of strangers
  newest_antenna_[source] = stamp;
  if (antennas_.size() >= kMostAntennas) antennas_.pop_front();  // odometry has ended
  antennas_.insert(std::ranges::upper_bound(antennas_, stamp, {}, &bags::AntennaSample::stamp), std::move(**sample));
  counts_.fixes += source.empty() ? 1 : 0;
  return {};
}

Status RosIntake::take_points(std::string_view bytes, std::string_view type, Encoding encoding) {
  const auto message = bags::decode_scan(type, bytes, encoding);
  if (!message) return tl::unexpected(message.error());
  const Timestamp sensor_stamp = message->header.stamp, stamp = sensor_stamp + config_.scan_offset_s;
  missed_scans_.note(sensor_stamp);
  counts_.missed_scans = missed_scans_.count();
  if (known_ && stamp <= *known_) return {};
  if (Status ok = scan_clock_.check(stamp, stamps_.newest()); !ok) return ok;
  if (std::string doubt = scan_clock_.take_doubt(); !doubt.empty()) note_ = "scans: " + doubt;
  if (Status ok = check_follows(stamp, newest_scan_); !ok) return ok;
  auto cloud = bags::to_timed_cloud(*message);
  if (!cloud) return tl::unexpected(cloud.error());
  if (cloud->cloud.points.empty()) return fail(ErrorCode::invalid, "holds no points");
  auto times = lidar::find_message_times(*cloud, sensor_stamp, config_.scan_times);
  if (!times) return tl::unexpected(times.error());
  double after_s = 0.0;  // of the last point
  if (*times) {
    const auto ages = lidar::point_ages(*cloud, sensor_stamp, **times);
    if (!ages) return tl::unexpected(ages.error());
    after_s = std::max(0.0, -double{std::ranges::min(*ages)});
    (*times)->strays = 0;  // each scan has others, and the note is of all
  }
  drop_from(stamp, scans_, [](const Waiting& waiting) { return waiting.stamp; });
  if (scans_.size() >= kMostScans) scans_.pop_front();  // odometry has ended
  newest_scan_ = stamp;
  scans_.push_back({stamp, stamp + after_s, message->header.frame_id, std::move(*cloud), std::move(*times)});
  ++counts_.scans;
  return {};
}

std::optional<OdometrySample> RosIntake::next_odometry(bool wait_for_scans) {
  if (samples_.empty()) return std::nullopt;
  if (waits_for_place()) return std::nullopt;
  const StampedPose sample = samples_.front();
  if (wait_for_scans && !(newest_scan_ && *newest_scan_ >= sample.stamp)) return std::nullopt;
  samples_.pop_front();
  if (last_ && sample.stamp <= last_->stamp) {  // of a clock that began anew
    last_.reset();
    history_.clear();
    has_whole_history_ = true;
  }
  OdometrySample out{sample.stamp, sample.pose, Matrix6d::Zero()};
  if (last_) out.increment_covariance = robot::increment_covariances({*last_, sample}, config_.covariance).front();
  if (std::exchange(unseen_, false)) out.increment_covariance = unseen();
  last_ = sample;
  history_.push_back(sample);
  const auto kept =
      std::ranges::find_if(history_, [&](const StampedPose& old) { return sample.stamp - old.stamp <= kHistory_s; });
  if (kept != history_.begin()) has_whole_history_ = false;
  history_.erase(history_.begin(), kept);
  return out;
}

Result<Pose3> RosIntake::pose_on_body(const std::string& frame) const {
  if (!frames_) return fail(ErrorCode::invalid, "no odometry has shown yet which frame is the body");
  const std::string from = bags::frame_name(frame), &body = frames_->body;
  if (const auto found = own_tree_.find(body, from)) return *found;
  if (own_frames_.empty())
    if (const auto found = tree_.find(body, from)) return *found;
  const auto found =
      tree().pose(body, from, own_frames_.empty() ? " on /tf_static" : " on tf_static of its namespace or /tf_static");
  return found ? found : fail(found.error().code, "{}", plain_text(found.error().message));
}

/// Whether the first scans wait for a transform that may still come.
bool RosIntake::waits_for_place() {
  if (is_placed_ || scans_.empty() || !frames_) return false;
  if (!held_since_) held_since_ = scans_.front().stamp;
  const auto newest = stamps_.newest();
  const bool is_late = newest && *newest - *held_since_ > waiting::kUnknown_s;
  is_placed_ = is_late || lidar_pose(scans_.front().frame).has_value();
  return !is_placed_;
}

Result<Pose3> RosIntake::lidar_pose(const std::string& frame) const {
  if (config_.T_body_lidar) return *config_.T_body_lidar;
  if (frames_->body.empty()) return Pose3{};
  const auto found = pose_on_body(frame);
  if (found) return found;
  return fail(ErrorCode::invalid,
              "where the LiDAR is on the robot is not known: {}; a mission file's robots[].T_body_lidar may say it",
              found.error().message);
}

Result<std::optional<Scan>> RosIntake::to_scan(Waiting waiting) const {
  const auto T_body_lidar = lidar_pose(waiting.frame);
  if (!T_body_lidar) return tl::unexpected(T_body_lidar.error());
  const double oldest_s = history_.empty() ? 0.0 : waiting.stamp - history_.front().stamp;
  if (waiting.times && !has_whole_history_ && oldest_s < lidar::kLongestAge_s)
    return fail(ErrorCode::invalid, "scan at {} ns comes too late, {:.1f} s after odometry of its time",
                waiting.stamp.ns, last_->stamp - waiting.stamp);
  return lidar::deskewed(std::move(waiting.cloud), waiting.stamp - config_.scan_offset_s, waiting.times, *T_body_lidar,
                         waiting.times ? lidar::with_ends(history_) : Trajectory{}, config_.scan_offset_s)
      .map([](Scan scan) { return std::optional(std::move(scan)); });
}

Result<std::optional<Scan>> RosIntake::next_scan(bool is_wanted) {
  if (waits_for_place()) return std::optional<Scan>{};
  while (!scans_.empty() && last_ && last_->stamp >= scans_.front().until) {
    Waiting waiting = std::move(scans_.front());
    scans_.pop_front();
    if (!is_wanted || is_before_all(waiting.stamp)) continue;
    std::string how = lidar::in_words(waiting.times);
    if (const auto at = lidar_pose(waiting.frame); at && !bags::doubt_of_place(*at).empty())
      how += "; the LiDAR is " + bags::doubt_of_place(*at);
    if (how != how_) note_ = how_ = std::move(how);
    auto scan = to_scan(std::move(waiting));
    if (!scan) ++counts_.refused;
    return scan;
  }
  return std::optional<Scan>{};
}

std::optional<Input> RosIntake::next_antenna() {
  constexpr std::size_t kMostSaid = 16;  // a stranger may send any number of frames
  while (!antennas_.empty() && last_ && last_->stamp >= antennas_.front().stamp()) {
    bags::AntennaSample sample = std::move(antennas_.front());
    antennas_.pop_front();
    if (is_before_all(sample.stamp())) continue;
    std::string how = fmt::format("{} are of {}", sample.range() == nullptr ? "fixes" : "ranges",
                                  bags::place_antenna(sample, config_.p_body_antenna, pose_on_body(sample.frame)));
    if (!sample.is_stated)
      how += fmt::format("; those that do not say how sure they are count as {:g} m and {:g} m up", kUnknownFix_m,
                         kUnknownFixUp_m);
    if (said_of_antennas_.size() < kMostSaid && said_of_antennas_.insert(how).second) note_ = std::move(how);
    return std::visit([](auto& of) { return Input(std::move(of)); }, sample.measured);
  }
  return std::nullopt;
}

}  // namespace tutti::intake
