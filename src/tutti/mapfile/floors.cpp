// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/floors.hpp"

#include <algorithm>
#include <map>

#include "tutti/mapfile/placement.hpp"

namespace tutti::mapfile {

Floors Floors::of(const Content& content, const server::MapEstimate& map) {
  Floors out;
  out.components_.push_back(component_to_show(content, map));
  std::map<std::uint32_t, std::size_t> submaps;
  for (const auto& [id, size] : content.payload_sizes)
    if (const auto at = place(*content.submaps.at(id), map)) ++submaps[at->component];
  for (const auto& [component, count] : submaps)
    if (component != out.components_.front() && count >= kLeastOfFloor) out.components_.push_back(component);
  return out;
}

std::optional<std::uint32_t> Floors::of_component(std::uint32_t component) const {
  const auto at = std::ranges::find(components_, component);
  if (at == components_.end()) return std::nullopt;
  return static_cast<std::uint32_t>(at - components_.begin()) + 1;
}

std::vector<Lift> lifts_of(const Floors& floors, const server::MapEstimate& map) {
  std::vector<Lift> out;
  for (std::size_t k = 1; k < map.nodes.size(); ++k) {  // by robot, session and keyframe
    const MapNode &last = map.nodes[k - 1], &first = map.nodes[k];
    const bool is_next = last.id.chain.robot == first.id.chain.robot && last.id.chain != first.id.chain;
    const double gap_s = first.stamp - last.stamp;
    if (!is_next || gap_s < 0.0 || gap_s > kLongestLift_s) continue;
    const auto from = floors.of_component(last.component), to = floors.of_component(first.component);
    if (from && to && from != to)
      out.push_back({{last.id.chain, *from, last.T_world_body}, {first.id.chain, *to, first.T_world_body}});
  }
  return out;
}

}  // namespace tutti::mapfile
