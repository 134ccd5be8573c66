// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/agent_state/internal/checks.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/wire/field_bytes.hpp"

namespace tutti::wire {
namespace {

// Only what an agent had to have checked is checked here: samples were within kMaxCoordinate_m when it took them, but
// what it computes of them need not be, nor need a covariance compounded over such distances be a covariance to
// rounding.
bool is_sound(const Pose3& T) { return is_valid(T); }
bool is_sound(const RelativePose& measured) { return is_sound(measured.T_a_b) && measured.covariance.allFinite(); }
bool is_sound(const lidar::PosedCloud& scan) { return is_sound(scan.T_submap_body); }
bool is_sound(const TrackedImages& images) { return check_images(images).has_value(); }
bool is_sound(const robot::Whereabouts& other) {
  return is_sound(other.T_map_body) &&
         (other.name.empty() || FieldChecker::check(other.name, {.text = FieldRule::Text::name}));
}
bool is_sound(const SubmapFix& fix) {
  return check_fix(fix.antenna, fix.covariance, fix.p_keyframe_antenna).has_value();
}
bool is_sound(const PositionFix& fix) { return check_fix(fix.antenna, fix.covariance, fix.p_body_antenna).has_value(); }
bool is_sound(const RobotRange& range) { return check_range(range).has_value(); }
bool is_sound(const robot::PlacedFix& fix) {
  return check_fix(fix.antenna, fix.covariance, Eigen::Vector3d::Zero()).has_value() && fix.p_odom_antenna.allFinite();
}
bool all_sound(const auto& list) {
  return std::ranges::all_of(list, [](const auto& element) { return is_sound(element); });
}

/// Keyframes that follow each other, with the odometry between them.
bool is_chain(const auto& keyframes, const auto& odometry) {
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

template <class Fix>
bool is_in_order(const std::vector<Fix>& fixes) {
  return all_sound(fixes) && std::ranges::is_sorted(fixes, {}, &Fix::stamp);
}

bool is_sound(const fit::SteadyDrift& drift) {
  return std::isfinite(drift.value) && std::isfinite(drift.weight) && drift.weight >= 0.0 &&
         std::isfinite(drift.square) && drift.square >= 0.0 && std::isfinite(drift.count) && drift.count >= 0.0;
}

bool is_sound(const robot::SubmapBuilderState& builder) {
  const auto is_whole = [](const robot::FinishedSubmap& finished) {
    return !finished.submap.keyframes.empty() && is_chain(finished.submap.keyframes, finished.submap.odometry) &&
           all_sound(finished.scans) && (!finished.scan_after || is_sound(*finished.scan_after)) &&
           all_sound(finished.images) && all_sound(finished.submap.fixes) && all_sound(finished.submap.ranges);
  };
  const auto follows = [](const StampedPose& a, const StampedPose& b) { return a.stamp >= b.stamp; };
  return is_chain(builder.keyframes, builder.odometry) && is_sound(builder.T_mended_odom) && is_sound(builder.drift) &&
         all_sound(builder.scans) && all_sound(builder.images) && std::ranges::all_of(builder.finished, is_whole) &&
         is_sound(builder.since_keyframe) &&
         std::ranges::all_of(builder.recent, [](const StampedPose& at) { return is_sound(at.pose); }) &&
         std::ranges::adjacent_find(builder.recent, follows) == builder.recent.end() &&
         builder.keyframes.empty() == builder.recent.empty() && std::isfinite(builder.distance_m) &&
         std::isfinite(builder.representative_distance_m) && is_sound(builder.waiting, builder.recent) &&
         is_in_order(builder.waiting_fixes) && is_in_order(builder.fixes) && all_sound(builder.ranges);
}

bool is_sound(const robot::OdometryWatch::State& watch) {
  const auto is_rate = [](const std::optional<double>& rate) {
    return !rate || (std::isfinite(*rate) && *rate >= 0.0);
  };
  return (!watch.newest || is_sound(watch.newest->pose)) && is_rate(watch.speed_mps) &&
         is_rate(watch.turn_rate_radps) &&
         (!watch.anchor || (is_sound(watch.anchor->T_odom_body) && is_sound(watch.anchor->T_fed_body)));
}

}  // namespace

const char* what_is_wrong(const robot::AgentState& state) {
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
  if (!is_sound(state.watch) || !is_sound(state.T_odom_body) || !is_sound(state.T_map_odom) ||
      !state.covariance.allFinite() || !all_sound(state.whereabouts))
    return "it is nowhere";
  return nullptr;
}

}  // namespace tutti::wire
