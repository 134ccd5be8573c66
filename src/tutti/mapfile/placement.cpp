// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/placement.hpp"

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

}  // namespace tutti::mapfile
