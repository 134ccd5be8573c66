// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report/geometry.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <unordered_map>

#include "tutti/evaluation/association.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/mission/report/format.hpp"

namespace tutti::mission {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// An estimate in the display frame, and its distance to the base at every stamp that has one.
struct Aligned {
  Pose3 T_base_estimate;
  Points3d positions;
  std::unordered_map<Timestamp, double> errors_m;
};

Aligned align_to(const Trajectory& base, const Trajectory& estimate, const evaluation::AssociationConfig& config) {
  const auto pairs = evaluation::associate(estimate, base, config);
  const auto fit = evaluation::ate(pairs);
  Aligned out;
  if (fit) out.T_base_estimate = fit->T_reference_estimate;
  for (const auto& p : estimate) out.positions.push_back(out.T_base_estimate * p.pose.translation);
  for (const auto& pair : pairs)
    out.errors_m[pair.stamp] = (out.T_base_estimate * pair.estimate.translation - pair.reference.translation).norm();
  return out;
}

double at(const std::unordered_map<Timestamp, double>& values, Timestamp stamp) {
  const auto found = values.find(stamp);
  return found == values.end() ? kNaN : found->second;
}

/// At every keyframe that has one at least kDriftWindow_s before it: error of the odometry since the last such.
std::unordered_map<Timestamp, double> born_errors(const RobotRecord& robot,
                                                  const evaluation::AssociationConfig& association) {
  const auto pairs = evaluation::associate(robot.odometry, robot.reference, association);
  std::unordered_map<Timestamp, double> out;
  std::size_t before = 0;
  for (const auto& now : pairs) {
    while (now.stamp - pairs[before + 1 < pairs.size() ? before + 1 : before].stamp >= kDriftWindow_s) ++before;
    const auto& then = pairs[before];
    if (now.stamp - then.stamp < kDriftWindow_s) continue;
    const Pose3 seen = then.estimate.inverse() * now.estimate;
    const Pose3 real = then.reference.inverse() * now.reference;
    out[now.stamp] = (real.inverse() * seen).translation.norm();
  }
  return out;
}

}  // namespace

RobotGeometry robot_geometry(const MissionRecord& record, const RobotRecord& robot) {
  RobotGeometry out;
  out.has_reference = !evaluation::associate(robot.odometry, robot.reference, record.association).empty();
  const Trajectory& base = out.has_reference                ? robot.reference
                           : !robot.server_estimate.empty() ? robot.server_estimate
                                                            : robot.odometry;
  const PolicyRecord* policy = find_policy(robot, record.default_policy);
  const Aligned onboard = align_to(base, robot.odometry, record.association);
  const Aligned corrected = policy != nullptr ? align_to(base, policy->corrected, record.association) : Aligned{};
  const Aligned server = align_to(base, robot.server_estimate, record.association);
  out.onboard = onboard.positions;
  out.corrected = corrected.positions;
  out.server = server.positions;
  out.T_base_odom = onboard.T_base_estimate;
  if (out.has_reference)
    for (const auto& p : robot.reference) out.reference.push_back(p.pose.translation);

  const auto born =
      out.has_reference ? born_errors(robot, record.association) : std::unordered_map<Timestamp, double>{};
  double distance_m = 0.0;
  for (std::size_t k = 0; k < robot.odometry.size(); ++k) {
    const auto& [stamp, pose] = robot.odometry[k];
    if (k > 0) distance_m += (pose.translation - robot.odometry[k - 1].pose.translation).norm();
    out.errors.push_back({distance_m, mission_clock(robot)(stamp), at(onboard.errors_m, stamp),
                          at(corrected.errors_m, stamp), out.has_reference ? at(server.errors_m, stamp) : kNaN,
                          at(born, stamp)});
  }
  return out;
}

PictureClock mission_clock(const RobotRecord& robot) {
  return {robot.odometry.empty() ? Timestamp{} : robot.odometry.front().stamp, robot.start_s};
}

Pose3 display_from_world(const MissionRecord& record, std::uint32_t component) {
  if (component != record.server.largest_component) return {};
  return record.server.T_reference_world.value_or(Pose3{});
}

}  // namespace tutti::mission
