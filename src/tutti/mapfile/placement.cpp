// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/placement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tutti/geometry/so3.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::mapfile {
namespace {

constexpr double kSureUp = 0.8;  // of a robot's nodes, whose mean up is shorter where they tilt

/// The sum of an axis of the bodies over all nodes of a component.
Eigen::Vector3d sum_of_axes(const server::MapEstimate& map, std::uint32_t component, const Eigen::Vector3d& axis,
                            double& nodes) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  nodes = 0.0;
  for (const MapNode& node : map.nodes) {
    if (node.component != component) continue;
    sum += node.T_world_body.rotation * axis;
    nodes += 1.0;
  }
  return sum;
}

/// The bodies' axis that is up. An axis that stays where it is while the body turns is the one that it turns about.
/// That is z, or, where bodies are cameras, y, which points down; where nothing turns much, z is believed.
Eigen::Vector3d up_axis(const server::MapEstimate& map, std::uint32_t component) {
  constexpr double kSteady = 0.8, kClearly = 0.2;
  double nodes = 0.0;
  const double y = sum_of_axes(map, component, Eigen::Vector3d::UnitY(), nodes).norm();
  const double z = sum_of_axes(map, component, Eigen::Vector3d::UnitZ(), nodes).norm();
  const bool is_camera = y > kSteady * nodes && y > z + kClearly * nodes;
  return is_camera ? Eigen::Vector3d(-Eigen::Vector3d::UnitY()) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

/// The direction that is up by a robot's nodes in a component.
struct Up {
  ChainId chain;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double nodes = 0.0;
  [[nodiscard]] bool is_sure() const { return sum.norm() >= kSureUp * nodes; }
};
std::map<RobotId, Up> ups(const server::MapEstimate& map, std::uint32_t component) {
  const Eigen::Vector3d axis = up_axis(map, component);
  std::map<RobotId, Up> out;
  for (const MapNode& node : map.nodes) {
    if (node.component != component) continue;
    Up& up = out[node.id.chain.robot];
    up.chain = node.id.chain;
    up.sum += node.T_world_body.rotation * axis;
    up.nodes += 1.0;
  }
  return out;
}

/// The mean of the bodies' axis that is up, shorter than 1 where they tilt; of the robots of most nodes, where others
/// are upside down to them.
Eigen::Vector3d mean_up(const server::MapEstimate& map, std::uint32_t component) {
  const auto all = ups(map, component);
  Up most;
  for (const auto& [robot, one] : all) {
    Up side;
    for (const auto& [other, up] : all)
      if (!one.is_sure() || !up.is_sure() || one.sum.dot(up.sum) >= 0.0) {
        side.sum += up.sum;
        side.nodes += up.nodes;
      }
    if (side.nodes > most.nodes) most = side;
  }
  return most.sum / std::max(most.nodes, 1.0);
}

}  // namespace

std::optional<Place> place(const Submap& submap, const server::MapEstimate& map) {
  const Keyframe& first = submap.keyframes.front();
  const Keyframe& middle = submap.keyframes[submap.keyframes.size() / 2];
  const auto* node = find_node(map, {submap.id.chain, middle.index});
  if (node == nullptr) return std::nullopt;
  return Place{node->component, node->T_world_body * middle.T_odom_body.inverse() * first.T_odom_body};
}

std::uint32_t component_to_show(const Content& content, const server::MapEstimate& map) {
  const std::uint32_t largest = server::choose_components(map).largest;
  std::map<std::uint32_t, std::size_t> points;
  for (const auto& [id, size] : content.payload_sizes)
    if (const auto at = place(*content.submaps.at(id), map); at && size.points > 0)
      points[at->component] += size.points;
  if (points.empty() || points.contains(largest)) return largest;
  return std::ranges::max_element(points, {}, [](const auto& entry) { return entry.second; })->first;
}

Pose3 level_frame(const server::MapEstimate& map, std::uint32_t component) {
  return {rotation_between(mean_up(map, component), Eigen::Vector3d::UnitZ()), Eigen::Vector3d::Zero()};
}

Pose3 upright_frame(const server::MapEstimate& map, std::uint32_t component) {
  constexpr double kKnown = 0.8;  // bodies that tilt in all directions do not determine what is up
  const Eigen::Vector3d up = mean_up(map, component);
  if (up.norm() < kKnown) return {};
  Eigen::Index axis = 2;
  up.cwiseAbs().maxCoeff(&axis);
  const Eigen::Vector3d nearest = std::copysign(1.0, up(axis)) * Eigen::Vector3d::Unit(axis);
  if (axis == 2)
    return {nearest.z() > 0.0 ? Eigen::Quaterniond::Identity() : Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0),
            Eigen::Vector3d::Zero()};
  return {rotation_between(nearest, Eigen::Vector3d::UnitZ()), Eigen::Vector3d::Zero()};
}

std::optional<std::string> disagreement_on_up(const Content& content, const server::MapEstimate& map,
                                              std::uint32_t component) {
  auto all = ups(map, component);
  std::erase_if(all, [](const auto& entry) { return !entry.second.is_sure(); });
  const auto names = content.closure_names();
  for (const auto& [robot, up] : all)
    if (const Up& first = all.begin()->second; first.sum.dot(up.sum) < 0.0)
      return fmt::format(
          "warning: {}'s up is {}'s down by the closures between them, so the ground here is one's ceiling: z of the "
          "body and of odometry's frame points up (docs/frames.md)",
          names.of(first.chain), names.of(up.chain));
  return std::nullopt;
}

std::string in_words(const Pose3& T_level_world) {
  const Eigen::Vector3d& t = T_level_world.translation;
  const Eigen::Quaterniond& q = T_level_world.rotation;
  return fmt::format("T_level_world {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} (x y z, quaternion x y z w)",
                     t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

}  // namespace tutti::mapfile
