// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/placement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "tutti/server/map_components.hpp"

namespace tutti::mapfile {

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
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const MapNode& node : map.nodes)
    if (node.component == component) up += node.T_world_body.rotation * Eigen::Vector3d::UnitZ();
  return {Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()), Eigen::Vector3d::Zero()};
}

std::string in_words(const Pose3& T_level_world) {
  const Eigen::Vector3d& t = T_level_world.translation;
  const Eigen::Quaterniond& q = T_level_world.rotation;
  return fmt::format("T_level_world {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} {:.9g} (x y z, quaternion x y z w)",
                     t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

}  // namespace tutti::mapfile
