// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_components.hpp"

#include <algorithm>
#include <compare>

namespace tutti::server {
namespace {

struct Size {
  std::size_t representatives = 0;
  std::size_t nodes = 0;
  Timestamp newest;
  friend auto operator<=>(const Size&, const Size&) = default;
};
using Sizes = std::map<std::uint32_t, Size>;

void count(const MapNode& node, Sizes& sizes) {
  Size& size = sizes[node.component];
  size.representatives += node.representative ? 1 : 0;
  size.newest = size.nodes++ == 0 ? node.stamp : std::max(size.newest, node.stamp);
}

std::uint32_t largest(const Sizes& sizes) {
  return std::ranges::max_element(sizes, {}, [](const auto& entry) { return entry.second; })->first;
}

}  // namespace

MapComponents choose_components(const MapEstimate& map) {
  std::map<ChainId, Sizes> by_chain;
  std::map<RobotId, Sizes> by_robot;
  for (const MapNode& node : map.nodes) {
    count(node, by_chain[node.id.chain]);
    count(node, by_robot[node.id.chain.robot]);
  }
  MapComponents out;
  for (const auto& [robot, sizes] : by_robot) out.of_robot[robot] = largest(sizes);
  for (const auto& [chain, sizes] : by_chain) out.of_chain[chain] = largest(sizes);
  Sizes together;
  for (const MapNode& node : map.nodes)
    if (node.component == out.of_chain.at(node.id.chain)) count(node, together);
  if (!together.empty()) out.largest = largest(together);
  return out;
}

}  // namespace tutti::server
