// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/closure_groups.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tutti::server {
namespace {

/// When the ends of a closure were seen, the chain with the smaller id first; of one chain the earlier end.
struct Ends {
  ChainId chains[2];
  Timestamp stamps[2];
};

Ends ends_of(const std::vector<MapNode>& nodes, const PoseGraphEdge& edge) {
  const MapNode* first = &nodes[edge.from];
  const MapNode* second = &nodes[edge.to];
  if (second->id < first->id) std::swap(first, second);
  return {{first->id.chain, second->id.chain}, {first->stamp, second->stamp}};
}

bool is_near(const Ends& a, const Ends& b, double most_s) {
  for (const int end : {0, 1})
    if (a.chains[end] != b.chains[end] || std::abs(a.stamps[end] - b.stamps[end]) > most_s) return false;
  return true;
}

}  // namespace

std::vector<std::vector<std::size_t>> closure_groups(const std::vector<MapNode>& nodes,
                                                     std::span<const PoseGraphEdge> edges,
                                                     std::span<const std::size_t> closures, const GroupLimits& limits) {
  std::vector<Ends> ends;
  for (const std::size_t e : closures) ends.push_back(ends_of(nodes, edges[e]));
  std::vector<bool> taken(closures.size(), false);
  std::vector<std::vector<std::size_t>> out;
  for (std::size_t first = 0; first < closures.size(); ++first) {
    if (taken[first]) continue;
    std::vector<std::size_t> group = {first};  // positions in `closures`
    taken[first] = true;
    for (std::size_t k = 0; k < group.size(); ++k)
      for (std::size_t other = first + 1; other < closures.size(); ++other)
        if (!taken[other] && is_near(ends[group[k]], ends[other], limits.near_s)) {
          taken[other] = true;
          group.push_back(other);
        }
    const auto is_long = [&](std::size_t a) {
      return std::ranges::any_of(group, [&](std::size_t b) { return !is_near(ends[a], ends[b], limits.longest_s); });
    };
    if (group.size() > limits.most_closures || std::ranges::any_of(group, is_long)) continue;
    std::ranges::sort(group);
    for (std::size_t& k : group) k = closures[k];
    out.push_back(std::move(group));
  }
  return out;
}

}  // namespace tutti::server
