// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "tutti/robot/agent.hpp"
#include "tutti/v1/messages.pb.h"

/// An agent's state as columns of numbers, to the bit.
namespace tutti::wire::archive {

using robot::AgentState;

class Writer {
 public:
  explicit Writer(v1::AgentState& out) : out_(out) {}
  void integer(const std::uint64_t& x) { out_.add_integer(x); }
  void number(const double& x) { out_.add_number(x); }
  void coordinate(const float& x) { out_.add_coordinate(x); }
  /// A list's length; returns how many elements follow.
  template <class T>
  std::size_t length(const std::vector<T>& list) {
    out_.add_integer(list.size());
    return list.size();
  }
  /// Whether more follows.
  [[nodiscard]] bool has_more(bool is_there) const { return is_there; }

 private:
  v1::AgentState& out_;
};

/// Gives zeros where there is nothing more; is_complete() shows it at the end.
class Reader {
 public:
  explicit Reader(const v1::AgentState& in) : in_(in) {}
  void integer(std::uint64_t& x) { x = next(in_.integer(), integers_); }
  void number(double& x) { x = next(in_.number(), numbers_); }
  void coordinate(float& x) { x = next(in_.coordinate(), coordinates_); }
  /// No list is made longer than what is left could fill.
  template <class T>
  std::size_t length(std::vector<T>& list) {
    const std::uint64_t count = next(in_.integer(), integers_);
    const auto left = [](const auto& column, int used) { return static_cast<std::size_t>(column.size() - used); };
    if (count > left(in_.integer(), integers_) + left(in_.number(), numbers_) + left(in_.coordinate(), coordinates_))
      short_ = true;
    list.resize(short_ ? 0 : static_cast<std::size_t>(count));
    return list.size();
  }
  [[nodiscard]] bool has_more(bool /*is_there*/) const { return integers_ < in_.integer_size(); }
  [[nodiscard]] bool is_complete() const {
    return !short_ && integers_ == in_.integer_size() && numbers_ == in_.number_size() &&
           coordinates_ == in_.coordinate_size();
  }

 private:
  template <class Column>
  typename Column::value_type next(const Column& column, int& used) {
    if (used < column.size()) return column.Get(used++);
    short_ = true;
    return 0;
  }
  const v1::AgentState& in_;
  int integers_ = 0, numbers_ = 0, coordinates_ = 0;
  bool short_ = false;
};

/// One pass through a state for writing and reading: `pass(archive, value)` writes the value or fills it.

template <class A, class Int>
requires std::is_integral_v<Int> || std::is_enum_v<Int>
void pass(A& a, Int& x) {
  auto wide = static_cast<std::uint64_t>(x);
  a.integer(wide);
  x = static_cast<Int>(wide);
}
template <class A>
void pass(A& a, double& x) {
  a.number(x);
}
template <class A>
void pass(A& a, float& x) {
  a.coordinate(x);
}
template <class A>
void pass(A& a, Timestamp& t) {
  pass(a, t.ns);
}
template <class A>
void pass(A& a, Eigen::Vector3f& point) {
  for (float& x : point) pass(a, x);
}
template <class A>
void pass(A& a, Pose3& T) {
  for (double& x : T.rotation.coeffs()) a.number(x);
  for (double& x : T.translation) a.number(x);
}
template <class A>
void pass(A& a, RelativePose& measured) {
  pass(a, measured.T_a_b);
  for (double& x : measured.covariance.reshaped()) a.number(x);
}
template <class A>
void pass(A& a, StampedPose& pose) {
  pass(a, pose.stamp);
  pass(a, pose.pose);
}
template <class A>
void pass(A& a, Keyframe& keyframe) {
  pass(a, keyframe.index);
  pass(a, keyframe.stamp);
  pass(a, keyframe.T_odom_body);
  pass(a, keyframe.representative);
}
template <class A>
void pass(A& a, estimation::ChainConstraint& constraint) {
  pass(a, constraint.from);
  pass(a, constraint.to);
  pass(a, constraint.measurement);
}
template <class A>
void pass(A& a, consistency::Constraint& constraint) {
  pass(a, constraint.from_stamp);
  pass(a, constraint.to_stamp);
  pass(a, constraint.from);
  pass(a, constraint.to);
  pass(a, constraint.measurement);
  pass(a, constraint.kind);
  pass(a, constraint.revision);
}
template <class A>
void pass(A& a, robot::Whereabouts& other) {
  pass(a, other.robot.value);
  pass(a, other.stamp);
  pass(a, other.T_map_body);
}
template <class A, class T>
void pass(A& a, std::vector<T>& list) {
  a.length(list);
  for (T& element : list) pass(a, element);
}
template <class A, class T>
void pass(A& a, LongList<T>& list) {
  std::vector<T> elements = list.all();
  pass(a, elements);
  list = elements;
}
/// Whether there is a value, and then one in any case.
template <class A, class T>
void pass(A& a, std::optional<T>& optional) {
  bool is_there = optional.has_value();
  T value = optional.value_or(T{});
  pass(a, is_there);
  pass(a, value);
  optional = is_there ? std::optional(std::move(value)) : std::nullopt;
}
/// Writes the same for nothing and for an empty value: nobody distinguishes them.
template <class A, class T>
void pass(A& a, std::shared_ptr<const T>& shared) {
  T value;
  if (shared != nullptr) value = *shared;
  pass(a, value);
  shared = std::make_shared<const T>(std::move(value));
}
template <class A>
void pass(A& a, PointCloud& cloud) {
  pass(a, cloud.points);
}
template <class A>
void pass(A& a, lidar::PosedCloud& scan) {
  pass(a, scan.stamp);
  pass(a, scan.T_submap_body);
  pass(a, scan.cloud);
}
template <class A>
void pass(A& a, TrackedKeypoint& keypoint) {
  for (float& x : keypoint.pixel) pass(a, x);
  pass(a, keypoint.sigma_px);
  pass(a, keypoint.track);
}
template <class A>
void pass(A& a, TrackedImage& image) {
  pass(a, image.camera);
  pass(a, image.keypoints);
  pass(a, image.descriptors.kind);
  pass(a, image.descriptors.words);
  pass(a, image.descriptors.bits);
}
template <class A>
void pass(A& a, Camera& camera) {
  CameraModel& model = camera.model;
  pass(a, model.kind);
  pass(a, model.width_px);
  pass(a, model.height_px);
  for (double* x : {&model.fx, &model.fy, &model.cx, &model.cy}) a.number(*x);
  for (std::size_t i = 0; i < distortion_numbers(model.kind); ++i) a.number(model.distortion[i]);
  pass(a, camera.T_body_camera);
}
template <class A>
void pass(A& a, ImuSample& sample) {
  pass(a, sample.stamp);
  for (double& x : sample.gyro) a.number(x);
  for (double& x : sample.accelerometer) a.number(x);
}
template <class A>
void pass(A& a, TrackedImages& images) {
  pass(a, images.stamp);
  pass(a, images.cameras);
  pass(a, images.images);
  pass(a, images.imu);
  ImuNoise& noise = images.imu_noise;
  for (double* x : {&noise.gyro_noise_density, &noise.gyro_random_walk, &noise.accelerometer_noise_density,
                    &noise.accelerometer_random_walk})
    a.number(*x);
}
template <class A>
void pass(A& a, robot::FinishedSubmap& finished) {
  pass(a, finished.submap.id.chain.robot.value);
  pass(a, finished.submap.id.chain.session);
  pass(a, finished.submap.id.index);
  pass(a, finished.submap.keyframes);
  pass(a, finished.submap.odometry);
  pass(a, finished.scan_after);
  pass(a, finished.scans);
  pass(a, finished.images);
  pass(a, finished.awaits_images);
}
template <class A>
void pass(A& a, robot::SubmapBuilderState& builder) {
  pass(a, builder.next_submap);
  pass(a, builder.T_mended_odom);
  for (double* sum : {&builder.drift.weight, &builder.drift.value, &builder.drift.square, &builder.drift.count})
    a.number(*sum);
  pass(a, builder.keyframes);
  pass(a, builder.odometry);
  pass(a, builder.scans);
  pass(a, builder.images);
  pass(a, builder.finished);
  pass(a, builder.since_keyframe);
  pass(a, builder.recent);
  pass(a, builder.distance_m);
  pass(a, builder.representative_distance_m);
}
template <class A>
void pass(A& a, Scan& scan) {
  pass(a, scan.stamp);
  pass(a, scan.cloud);
  bool has_ages = scan.age_s != nullptr;
  pass(a, has_ages);
  if (has_ages) pass(a, scan.age_s);
}
template <class A>
void pass(A& a, robot::OdometryStep& step) {
  pass(a, step.stamp);
  pass(a, step.T_odom_body);
  for (double& x : step.covariance.reshaped()) a.number(x);
}
template <class A>
void pass(A& a, robot::SensorSample& sample) {
  pass(a, sample.stamp);
  const auto pass_optional = [&](auto& what) {
    bool is_there = what.has_value();
    pass(a, is_there);
    if (!is_there) return;
    if (!what) what.emplace();
    pass(a, *what);
  };
  pass_optional(sample.scan);
  pass_optional(sample.images);
}
/// The part of a builder that waits to make keyframes.
template <class A>
void pass_waiting(A& a, robot::SubmapBuilderState& builder) {
  std::vector<robot::OdometryStep> odometry(builder.waiting.odometry.begin(), builder.waiting.odometry.end());
  pass(a, odometry);
  builder.waiting.odometry.assign(odometry.begin(), odometry.end());
  pass(a, builder.waiting.sensors);
  pass(a, builder.heard_scan);
  pass(a, builder.heard_images);
  pass(a, builder.due);
  pass(a, builder.is_blind);
  pass(a, builder.keyframes_without_scan);
  pass(a, builder.keyframes_without_images);
}
template <class A>
void pass(A& a, robot::OdometryWatch::State::Anchor& anchor) {
  pass(a, anchor.T_odom_body);
  pass(a, anchor.T_fed_body);
}
/// Odometry as it was before its jumps were removed: after pass_waiting(), whose samples it marks.
template <class A>
void pass_watch(A& a, AgentState& state) {
  robot::OdometryWatch::State& watch = state.watch;
  pass(a, watch.newest);
  pass(a, watch.speed_mps);
  pass(a, watch.turn_rate_radps);
  pass(a, watch.anchor);
  for (robot::OdometryStep& step : state.submaps.waiting.odometry) pass(a, step.is_jump);
}
template <class A>
void pass(A& a, Eigen::Matrix3d& matrix) {
  for (double& x : matrix.reshaped()) a.number(x);
}
template <class A>
void pass(A& a, Eigen::Vector3d& vector) {
  for (double& x : vector) a.number(x);
}
template <class A>
void pass(A& a, Geodetic& position) {
  for (double* x : {&position.latitude_deg, &position.longitude_deg, &position.height_m}) a.number(*x);
}
template <class A>
void pass(A& a, PositionFix& fix) {
  pass(a, fix.stamp);
  pass(a, fix.antenna);
  pass(a, fix.covariance);
  pass(a, fix.p_body_antenna);
}
template <class A>
void pass(A& a, robot::PlacedFix& fix) {
  pass(a, fix.stamp);
  pass(a, fix.p_odom_antenna);
  pass(a, fix.antenna);
  pass(a, fix.covariance);
}
template <class A>
void pass(A& a, SubmapFix& fix) {
  pass(a, fix.keyframe);
  pass(a, fix.p_keyframe_antenna);
  pass(a, fix.antenna);
  pass(a, fix.covariance);
}
template <class A>
void pass_fixes(A& a, robot::SubmapBuilderState& builder) {
  pass(a, builder.waiting_fixes);
  pass(a, builder.fixes);
  pass(a, builder.heard_fix);
  for (robot::FinishedSubmap& finished : builder.finished) pass(a, finished.submap.fixes);
}
template <class A>
void pass(A& a, RobotRange& range) {
  pass(a, range.stamp);
  pass(a, range.to.value);
  pass(a, range.distance_m);
  pass(a, range.sigma_m);
  pass(a, range.p_body_antenna);
}
/// The last of all, and only where there are any: states without are those of before there were ranges.
template <class A>
void pass_ranges(A& a, robot::SubmapBuilderState& builder) {
  const auto has_some = [](const robot::FinishedSubmap& finished) { return !finished.submap.ranges.empty(); };
  if (!a.has_more(!builder.ranges.empty() || std::ranges::any_of(builder.finished, has_some))) return;
  pass(a, builder.ranges);
  for (robot::FinishedSubmap& finished : builder.finished) pass(a, finished.submap.ranges);
}
/// Team-mates' names.
template <class A>
void pass_names(A& a, AgentState& state) {
  for (robot::Whereabouts& other : state.whereabouts) {
    std::vector<std::uint8_t> letters(other.name.begin(), other.name.end());
    pass(a, letters);
    other.name.assign(letters.begin(), letters.end());
  }
}
template <class A>
void pass(A& a, AgentState& state) {
  pass(a, state.session);
  pass(a, state.sequence);
  pass(a, state.epoch);
  pass(a, state.revision);
  pass(a, state.comparisons);
  pass(a, state.submaps);
  pass(a, state.smoother.first);
  pass(a, state.smoother.odometry);
  pass(a, state.smoother.constraints);
  pass(a, state.smoother.poses);
  std::vector<consistency::Constraint> ledger = state.ledger.constraints();
  pass(a, ledger);
  state.ledger = consistency::Ledger(std::move(ledger));
  pass(a, state.keyframes);
  pass(a, state.submap_of);
  pass(a, state.node_odometry);
  pass(a, state.since_node);
  pass(a, state.T_odom_body);
  pass(a, state.T_map_odom);
  for (double& x : state.covariance.reshaped()) a.number(x);
  pass(a, state.whereabouts);
  pass(a, state.component);
  pass_waiting(a, state.submaps);
  pass_watch(a, state);
  pass_fixes(a, state.submaps);
  pass_names(a, state);
  pass_ranges(a, state.submaps);
}

}  // namespace tutti::wire::archive
