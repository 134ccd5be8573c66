// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/placement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tutti/server/map_components.hpp"

namespace tutti::mapfile {
namespace {

/// The mean of the bodies' axis that is up, shorter than 1 where they tilt. A body's axis that stays where it is while
/// the body turns is the one that it turns about. That is z, or, where bodies are cameras, y, which points down; where
/// nothing turns much, z is believed.
Eigen::Vector3d mean_up(const server::MapEstimate& map, std::uint32_t component) {
  constexpr double kSteady = 0.8, kClearly = 0.2;
  Eigen::Vector3d y = Eigen::Vector3d::Zero(), z = Eigen::Vector3d::Zero();
  double count = 0.0;
  for (const MapNode& node : map.nodes) {
    if (node.component != component) continue;
    y += node.T_world_body.rotation * Eigen::Vector3d::UnitY();
    z += node.T_world_body.rotation * Eigen::Vector3d::UnitZ();
    count += 1.0;
  }
  const bool is_camera = y.norm() > kSteady * count && y.norm() > z.norm() + kClearly * count;
  return (is_camera ? Eigen::Vector3d(-y) : z) / std::max(count, 1.0);
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
  return {Eigen::Quaterniond::FromTwoVectors(mean_up(map, component), Eigen::Vector3d::UnitZ()),
          Eigen::Vector3d::Zero()};
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
  return {Eigen::Quaterniond::FromTwoVectors(nearest, Eigen::Vector3d::UnitZ()), Eigen::Vector3d::Zero()};
}

std::string in_words(const Pose3& T_level_world) {
  const Eigen::Vector3d& t = T_level_world.translation;
  const Eigen::Quaterniond& q = T_level_world.rotation;
  return fmt::format("T_level_world {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} (x y z, quaternion x y z w)",
                     t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

}  // namespace tutti::mapfile
