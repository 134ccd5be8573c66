// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "tutti/geometry/pose3.hpp"
#include "tutti/v1/messages.pb.h"
#include "tutti/wire/agent_state.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/payload.hpp"

namespace tutti::wire {
namespace {

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

 private:
  v1::AgentState& out_;
};

/// Gives zeros where there is nothing more; is_complete() tells at the end.
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

// One way through a state for writing and reading: `pass(archive, value)` writes the value or fills it.

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
void pass(A& a, Timestamp& t) {
  pass(a, t.ns);
}
template <class A>
void pass(A& a, Eigen::Vector3f& point) {
  for (float& x : point) a.coordinate(x);
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
/// Of no cloud and of an empty one, the points are none: nobody tells them apart.
template <class A>
void pass(A& a, lidar::PosedCloud& scan) {
  pass(a, scan.T_submap_body);
  PointCloud cloud;
  if (scan.cloud != nullptr) cloud = *scan.cloud;
  pass(a, cloud.points);
  scan.cloud = std::make_shared<const PointCloud>(std::move(cloud));
}
template <class A>
void pass(A& a, TrackedKeypoint& keypoint) {
  for (float& x : keypoint.pixel) a.coordinate(x);
  a.coordinate(keypoint.sigma_px);
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
  for (double& x : model.distortion) a.number(x);
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
  std::vector<Camera> cameras;
  if (images.cameras != nullptr) cameras = *images.cameras;
  pass(a, cameras);
  images.cameras = std::make_shared<const std::vector<Camera>>(std::move(cameras));
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
  pass(a, finished.scans);
  pass(a, finished.images);
  pass(a, finished.awaits_images);
}
template <class A>
void pass(A& a, robot::SubmapBuilderState& builder) {
  pass(a, builder.next_submap);
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
  bool has_component = state.component.has_value();
  std::uint32_t component = state.component.value_or(0);
  pass(a, has_component);
  pass(a, component);
  state.component = has_component ? std::optional(component) : std::nullopt;
}

// What is checked here is what an agent had to have checked: samples were within kMaxCoordinate_m when it took them,
// but what it computes of them need not be, nor need a covariance compounded over such ways be a covariance to
// rounding.
bool is_sound(const Pose3& T) { return is_valid(T); }
bool is_sound(const RelativePose& measured) { return is_sound(measured.T_a_b) && measured.covariance.allFinite(); }
bool is_sound(const lidar::PosedCloud& scan) { return is_sound(scan.T_submap_body); }
bool is_sound(const TrackedImages& images) { return check_images(images).has_value(); }
bool is_sound(const robot::Whereabouts& other) { return is_sound(other.T_map_body); }
template <class T>
bool all_sound(const std::vector<T>& list) {
  return std::ranges::all_of(list, [](const T& element) { return is_sound(element); });
}

/// Keyframes that follow each other, with the odometry between them.
bool is_chain(const std::vector<Keyframe>& keyframes, const std::vector<RelativePose>& odometry) {
  if (odometry.size() + 1 != std::max<std::size_t>(1, keyframes.size())) return false;
  for (std::size_t k = 0; k < keyframes.size(); ++k) {
    if (!is_sound(keyframes[k].T_odom_body)) return false;
    if (k > 0 && (keyframes[k].index != keyframes[k - 1].index + 1 || keyframes[k].stamp <= keyframes[k - 1].stamp))
      return false;
  }
  return all_sound(odometry);
}

bool is_sound(const robot::SubmapBuilderState& builder) {
  const auto is_whole = [](const robot::FinishedSubmap& finished) {
    return !finished.submap.keyframes.empty() && is_chain(finished.submap.keyframes, finished.submap.odometry) &&
           all_sound(finished.scans) && all_sound(finished.images);
  };
  const auto follows = [](const StampedPose& a, const StampedPose& b) { return a.stamp >= b.stamp; };
  return is_chain(builder.keyframes, builder.odometry) && all_sound(builder.scans) && all_sound(builder.images) &&
         std::ranges::all_of(builder.finished, is_whole) && is_sound(builder.since_keyframe) &&
         std::ranges::all_of(builder.recent, [](const StampedPose& at) { return is_sound(at.pose); }) &&
         std::ranges::adjacent_find(builder.recent, follows) == builder.recent.end() &&
         builder.keyframes.empty() == builder.recent.empty() && std::isfinite(builder.distance_m) &&
         std::isfinite(builder.representative_distance_m);
}

/// What an agent relies on in the state that it goes on from.
const char* what_is_wrong(const AgentState& state) {
  const std::size_t keyframes = state.keyframes.size();
  const estimation::SmootherState& smoother = state.smoother;
  if (!is_chain(state.keyframes, smoother.odometry)) return "its keyframes are no chain";
  if (!is_sound(smoother.first) || smoother.poses.size() != smoother.odometry.size() + 1 ||
      !std::ranges::all_of(smoother.poses, [](const Pose3& T) { return is_sound(T); }))
    return "its corrected poses are not those of its keyframes";
  const auto is_between = [&](const auto& c) {
    return c.from < keyframes && c.to < keyframes && is_sound(c.measurement);
  };
  if (!std::ranges::all_of(smoother.constraints, is_between) ||
      !std::ranges::all_of(state.ledger.constraints(), is_between) ||
      !std::ranges::all_of(state.ledger.constraints(), [](const consistency::Constraint& c) {
        return c.kind <= consistency::ConstraintKind::other && c.from_stamp <= c.to_stamp;
      }))
    return "its constraints are not between its keyframes";
  const auto nodes = std::ranges::count_if(state.keyframes, &Keyframe::representative);
  if (state.submap_of.size() != keyframes || state.node_odometry.size() != static_cast<std::size_t>(nodes) ||
      !all_sound(state.node_odometry) || !is_sound(state.since_node))
    return "its nodes are not those of its keyframes";
  if (!is_sound(state.submaps) || state.submaps.keyframes.empty() != state.keyframes.empty())
    return "its open submap is none";
  if (!is_sound(state.T_odom_body) || !is_sound(state.T_map_odom) || !state.covariance.allFinite() ||
      !all_sound(state.whereabouts))
    return "it is nowhere";
  return nullptr;
}

}  // namespace

std::string encode(const AgentState& state) {
  v1::AgentState out;
  Writer writer(out);
  AgentState copy = state;
  pass(writer, copy);
  return pack_frame(MessageKind::agent_state, out.SerializeAsString());
}

Result<AgentState> decode_agent_state(std::string_view bytes) {
  const auto parsed = parse_frame<v1::AgentState>(MessageKind::agent_state, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  AgentState state;
  Reader reader(parsed->message);
  pass(reader, state);
  if (!reader.is_complete()) return fail(ErrorCode::parse, "agent state: not as many numbers as its lengths say");
  if (const char* wrong = what_is_wrong(state)) return fail(ErrorCode::invalid, "agent state: {}", wrong);
  return state;
}

std::string encode(const TrackedImages& images) {
  v1::AgentState out;
  Writer writer(out);
  TrackedImages copy = images;
  pass(writer, copy);
  return pack_frame(MessageKind::tracked_images, out.SerializeAsString());
}

Result<TrackedImages> decode_tracked_images(std::string_view bytes) {
  const auto parsed = parse_frame<v1::AgentState>(MessageKind::tracked_images, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  TrackedImages images;
  Reader reader(parsed->message);
  pass(reader, images);
  if (!reader.is_complete()) return fail(ErrorCode::parse, "tracked images: not as many numbers as their lengths say");
  return images;
}

}  // namespace tutti::wire
