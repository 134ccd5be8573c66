// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>
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
  [[nodiscard]] bool has_more() const { return true; }
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
  [[nodiscard]] bool has_more() const { return integers_ < in_.integer_size(); }
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
void pass(A& a, std::optional<Timestamp>& stamp) {
  bool is_known = stamp.has_value();
  Timestamp value = stamp.value_or(Timestamp{});
  pass(a, is_known);
  pass(a, value);
  stamp = is_known ? std::optional(value) : std::nullopt;
}
template <class A>
void pass(A& a, Scan& scan) {
  pass(a, scan.stamp);
  PointCloud cloud;
  if (scan.cloud != nullptr) cloud = *scan.cloud;
  pass(a, cloud.points);
  scan.cloud = std::make_shared<const PointCloud>(std::move(cloud));
  bool has_ages = scan.age_s != nullptr;
  pass(a, has_ages);
  if (!has_ages) return;
  std::vector<float> ages;
  if (scan.age_s != nullptr) ages = *scan.age_s;
  a.length(ages);
  for (float& age_s : ages) a.coordinate(age_s);
  scan.age_s = std::make_shared<const std::vector<float>>(std::move(ages));
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
/// What keyframes wait for: the last of a state, and not in one of before there was such a thing.
template <class A>
void pass_waiting(A& a, robot::SubmapBuilderState& builder) {
  if (!a.has_more()) return;
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
  pass_waiting(a, state.submaps);
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

/// In the order of time, after the last step that was taken; sensors with what they saw.
bool is_sound(const robot::SensorTimeline& waiting, const Trajectory& taken) {
  const auto follows = [](const auto& a, const auto& b) { return a.stamp >= b.stamp; };
  const auto is_after = [&](const auto& list) {
    return list.empty() || (!taken.empty() && list.front().stamp > taken.back().stamp);
  };
  return is_after(waiting.odometry) && is_after(waiting.sensors) &&
         std::ranges::adjacent_find(waiting.odometry, follows) == waiting.odometry.end() &&
         std::ranges::adjacent_find(waiting.sensors, follows) == waiting.sensors.end() &&
         std::ranges::all_of(waiting.odometry,
                             [](const robot::OdometryStep& step) {
                               return is_sound(step.T_odom_body) && step.covariance.allFinite();
                             }) &&
         std::ranges::all_of(waiting.sensors, [](const robot::SensorSample& sample) {
           return !sample.images || is_sound(*sample.images);
         });
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
         std::isfinite(builder.representative_distance_m) && is_sound(builder.waiting, builder.recent);
}

/// What an agent relies on in the state that it goes on from.
const char* what_is_wrong(const AgentState& state) {
  const std::size_t keyframes = state.keyframes.size();
  const estimation::SmootherState& smoother = state.smoother;
  if (!is_chain(state.keyframes, smoother.odometry)) return "its keyframes are no chain";
  const std::size_t poses = smoother.odometry.size() + 1;
  if (!is_sound(smoother.first) || !all_sound(smoother.poses) || !all_sound(smoother.solution) ||
      smoother.poses.size() > poses || smoother.held > poses)
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
  if (!smoother.solution.empty() &&
      smoother.solution.size() != estimation::OnboardSmoother::solution_size(smoother.constraints))
    return "its solution is not that of its constraints";
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

template <class T>
std::string encode_part(T&& value) {
  v1::AgentState out;
  Writer writer(out);
  pass(writer, value);
  return pack_frame(MessageKind::agent_state, out.SerializeAsString());
}

/// Of a whole frame: its numbers, all of them.
template <class T>
Status decode_part(std::string_view bytes, T& value) {
  const auto parsed = parse_frame<v1::AgentState>(MessageKind::agent_state, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  Reader reader(parsed->message);
  pass(reader, value);
  if (!reader.is_complete()) return fail(ErrorCode::parse, "agent state: not as many numbers as its lengths say");
  return {};
}

constexpr const char* kHead = "head";
constexpr const char* kCorrections = "corrections";
constexpr std::string_view kChain = "chain/";
constexpr std::string_view kLink = "link/";
constexpr std::size_t kChainRow = 4096;  // keyframes at most

/// 8 bytes, most significant first: keys sort as numbers do.
std::string number_key(std::uint64_t number) {
  std::string key;
  for (int shift = 56; shift >= 0; shift -= 8) key.push_back(static_cast<char>((number >> shift) & 0xffU));
  return key;
}
std::string chain_key(std::size_t first) { return std::string(kChain) + number_key(first); }
std::string link_key(const consistency::Constraint& link) {
  return std::string(kLink) + number_key(link.from) + number_key(link.to);
}

/// Keyframes of a chain with what belongs to each: the first of all has no odometry, a representative one that of its
/// node.
struct ChainPart {
  std::uint64_t first = 0;
  std::vector<Keyframe> keyframes;
  std::vector<std::uint32_t> submap_of;
  std::vector<RelativePose> odometry;
  std::vector<RelativePose> node_odometry;
};
template <class A>
void pass(A& a, ChainPart& part) {
  pass(a, part.first);
  pass(a, part.keyframes);
  pass(a, part.submap_of);
  pass(a, part.odometry);
  pass(a, part.node_odometry);
}

/// What of a smoother is neither chain nor follows from the ledger.
struct Corrections {
  Pose3 first;
  std::vector<estimation::ChainConstraint> constraints;  ///< Where they are not the ledger's.
  bool are_ledgers = true;
  std::vector<Pose3> held;
  std::vector<Pose3> solution;
};
template <class A>
void pass(A& a, Corrections& corrections) {
  pass(a, corrections.first);
  pass(a, corrections.are_ledgers);
  pass(a, corrections.constraints);
  pass(a, corrections.held);
  pass(a, corrections.solution);
}

std::vector<estimation::ChainConstraint> constraints_of(const consistency::Ledger& ledger) {
  std::vector<estimation::ChainConstraint> out;
  for (const consistency::Constraint& c : ledger.constraints()) out.push_back({c.from, c.to, c.measurement});
  return out;
}

void put_chain(const robot::RobotAgent& agent, std::size_t from, StateRows& rows) {
  const std::vector<Keyframe>& keyframes = agent.keyframes();
  const auto at = [](const auto& list, std::size_t index) { return list.begin() + static_cast<std::ptrdiff_t>(index); };
  const auto is_node = [](const Keyframe& keyframe) { return keyframe.representative; };
  // Nodes are counted from the end: the part that is new is short.
  std::size_t node = agent.node_odometry().size() -
                     static_cast<std::size_t>(std::count_if(at(keyframes, from), keyframes.end(), is_node));
  for (std::size_t first = from; first < keyframes.size(); first += kChainRow) {
    const std::size_t last = std::min(first + kChainRow, keyframes.size());
    ChainPart part{.first = first,
                   .keyframes = {at(keyframes, first), at(keyframes, last)},
                   .submap_of = {at(agent.submap_of(), first), at(agent.submap_of(), last)},
                   .odometry = {at(agent.smoother().odometry, std::max<std::size_t>(first, 1) - 1),
                                at(agent.smoother().odometry, last - 1)},
                   .node_odometry = {}};
    const auto nodes = static_cast<std::size_t>(std::ranges::count_if(part.keyframes, is_node));
    part.node_odometry = {at(agent.node_odometry(), node), at(agent.node_odometry(), node + nodes)};
    node += nodes;
    rows.emplace(chain_key(first), encode_part(part));
  }
}

/// Both are sorted by the stamps of the ends, of which there is one per pair.
void put_links(const std::vector<consistency::Constraint>& before, const std::vector<consistency::Constraint>& now,
               StateChange& change) {
  std::map<std::string, const consistency::Constraint*> old;
  for (const consistency::Constraint& link : before) old.emplace(link_key(link), &link);
  for (const consistency::Constraint& link : now) {
    const auto found = old.find(link_key(link));
    if (found == old.end() || !(*found->second == link))
      change.put.emplace(link_key(link), encode_part(consistency::Constraint(link)));
    if (found != old.end()) old.erase(found);
  }
  for (const auto& [key, link] : old) change.removed.push_back(key);
}

}  // namespace

std::string encode(const AgentState& state) { return encode_part(AgentState(state)); }

Result<AgentState> decode_agent_state(std::string_view bytes) {
  AgentState state;
  if (auto ok = decode_part(bytes, state); !ok) return tl::unexpected(ok.error());
  state.smoother.held = state.smoother.poses.size();
  if (state.smoother.poses.size() != state.smoother.odometry.size() + 1)
    return fail(ErrorCode::invalid, "agent state: its corrected poses are not those of its keyframes");
  if (const char* wrong = what_is_wrong(state)) return fail(ErrorCode::invalid, "agent state: {}", wrong);
  return state;
}

StateChange changed_rows(const robot::RobotAgent& agent, StoredState& stored) {
  StateChange change;
  AgentState head{agent.head(), {}, {}, {}, {}, {}};
  const std::uint64_t comparisons = head.comparisons;
  change.put.emplace(kHead, encode_part(head));
  put_chain(agent, stored.keyframes, change.put);
  const bool moved = !stored.has_corrections || stored.comparisons != comparisons;
  if (moved) {
    const estimation::SmootherState& smoother = agent.smoother();
    Corrections corrections{.first = smoother.first, .constraints = {}, .held = {}, .solution = smoother.solution};
    corrections.held = {smoother.poses.begin(), smoother.poses.begin() + static_cast<std::ptrdiff_t>(smoother.held)};
    corrections.are_ledgers = constraints_of(agent.ledger()) == smoother.constraints;
    if (!corrections.are_ledgers) corrections.constraints = smoother.constraints;
    change.put.emplace(kCorrections, encode_part(corrections));
    put_links(stored.links, agent.ledger().constraints(), change);
    stored.links = agent.ledger().constraints();
  }
  stored.keyframes = agent.keyframes().size();
  stored.comparisons = comparisons;
  stored.has_corrections = stored.keyframes > 0;  // the first of them sets the first pose
  return change;
}

StoredState stored_state(const AgentState& state) {
  return {state.keyframes.size(), state.comparisons, !state.keyframes.empty(), state.ledger.constraints()};
}

Result<AgentState> decode_state_rows(const StateRows& rows) {
  AgentState state;
  Corrections corrections;
  std::vector<consistency::Constraint> links;
  Status ok;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  const auto take = [&](const std::string& key, auto& value) {
    const auto found = rows.find(key);
    ok = found == rows.end() ? Status(fail(ErrorCode::invalid, "agent state: no row {}", key))
                             : decode_part(found->second, value);
    return ok.has_value();
  };
  if (!take(kHead, state) || !take(kCorrections, corrections)) return tl::unexpected(ok.error());
  for (auto row = rows.lower_bound(kChain); row != rows.end() && row->first.starts_with(kChain); ++row) {
    ChainPart part;
    if (ok = decode_part(row->second, part); !ok) return tl::unexpected(ok.error());
    if (part.first != state.keyframes.size() || row->first != chain_key(part.first))
      return fail(ErrorCode::invalid, "agent state: keyframes from {} on, expected from {}", part.first,
                  state.keyframes.size());
    append(state.keyframes, part.keyframes);
    append(state.submap_of, part.submap_of);
    append(state.smoother.odometry, part.odometry);
    append(state.node_odometry, part.node_odometry);
  }
  for (auto row = rows.lower_bound(kLink); row != rows.end() && row->first.starts_with(kLink); ++row) {
    links.emplace_back();
    if (ok = decode_part(row->second, links.back()); !ok) return tl::unexpected(ok.error());
  }
  state.ledger = consistency::Ledger(std::move(links));
  state.smoother.first = corrections.first;
  state.smoother.constraints =
      corrections.are_ledgers ? constraints_of(state.ledger) : std::move(corrections.constraints);
  state.smoother.held = corrections.held.size();
  state.smoother.poses = std::move(corrections.held);
  state.smoother.solution = std::move(corrections.solution);
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
