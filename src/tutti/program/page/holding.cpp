// SPDX-License-Identifier: BSD-3-Clause
// Which parts of a map hang on how many closures.
#include <iterator>
#include <map>
#include <optional>
#include <queue>
#include <set>
#include <utility>
#include <vector>

#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace {

/// With more parts than these nothing is computed for any: the count takes a flow through all of them for each.
constexpr std::size_t kMostParts = 300;

/// Submaps of one session without a gap are one part, which odometry joins.
struct Parts {
  std::map<SubmapId, std::size_t> of_submap;
  std::vector<std::size_t> submaps;  // how many
  std::vector<std::uint32_t> component;
};

Parts parts_of(const server::SubmapSet& submaps, const server::MapEstimate& map) {
  Parts out;
  std::optional<SubmapId> last;
  for (const auto& [id, submap] : submaps) {
    const MapNode* const node = find_node(map, {id.chain, submap->keyframes.front().index});
    if (node == nullptr) continue;
    const bool goes_on =
        last && last->chain == id.chain && last->index + 1 == id.index && out.component.back() == node->component;
    if (!goes_on) {
      out.submaps.push_back(0);
      out.component.push_back(node->component);
    }
    ++out.submaps.back();
    out.of_submap[id] = out.submaps.size() - 1;
    last = id;
  }
  return out;
}

/// Submaps by their first keyframe.
using Beginnings = std::map<KeyframeId, SubmapId>;

/// The submap that a keyframe of the map is in.
std::optional<SubmapId> submap_with(const Beginnings& beginnings, const KeyframeId& keyframe) {
  const auto after = beginnings.upper_bound(keyframe);
  return after == beginnings.begin() ? std::nullopt : std::optional(std::prev(after)->second);
}

using Weights = std::vector<std::map<std::size_t, std::size_t>>;

/// The largest flow between two parts, which is the weight of the lightest cut: by shortest paths (Edmonds and Karp
/// 1972), each of which adds at least one closure.
std::size_t lightest_cut(Weights left, std::size_t from, std::size_t to) {
  std::size_t flow = 0;
  while (true) {
    std::vector<std::optional<std::size_t>> before(left.size());
    std::queue<std::size_t> next({from});
    before[from] = from;
    while (!next.empty() && !before[to]) {
      const std::size_t at = next.front();
      next.pop();
      for (const auto& [other, weight] : left[at])
        if (weight > 0 && !before[other]) {
          before[other] = at;
          next.push(other);
        }
    }
    if (!before[to]) return flow;
    for (std::size_t at = to; at != from; at = *before[at]) {
      --left[*before[at]][at];
      ++left[at][*before[at]];
    }
    ++flow;
  }
}

}  // namespace

std::map<SubmapId, std::size_t> closures_holding(const server::SubmapSet& submaps, const server::MapEstimate& map) {
  const Parts parts = parts_of(submaps, map);
  std::map<SubmapId, std::size_t> out;
  if (parts.submaps.size() < 2 || parts.submaps.size() > kMostParts) return out;
  Beginnings beginnings;
  for (const auto& [id, submap] : submaps) beginnings.try_emplace({id.chain, submap->keyframes.front().index}, id);
  std::set<std::pair<SubmapId, SubmapId>> pairs;
  for (const server::JudgedClosure& judged : map.closures) {
    if (!judged.accepted) continue;
    const auto first = submap_with(beginnings, judged.closure.from),
               second = submap_with(beginnings, judged.closure.to);
    if (first && second) pairs.emplace(*first, *second);
  }
  Weights weights(parts.submaps.size());
  for (const auto& [first, second] : pairs) {
    const auto a = parts.of_submap.find(first), b = parts.of_submap.find(second);
    if (a == parts.of_submap.end() || b == parts.of_submap.end() || a->second == b->second) continue;
    ++weights[a->second][b->second];
    ++weights[b->second][a->second];
  }
  std::map<std::uint32_t, std::size_t> roots;  // by component
  for (std::size_t part = 0; part < parts.submaps.size(); ++part) {
    const auto [root, is_first] = roots.try_emplace(parts.component[part], part);
    if (!is_first && parts.submaps[part] > parts.submaps[root->second]) root->second = part;
  }
  std::vector<std::size_t> cuts(parts.submaps.size(), 0);
  for (std::size_t part = 0; part < cuts.size(); ++part)
    if (const std::size_t root = roots.at(parts.component[part]); root != part)
      cuts[part] = lightest_cut(weights, root, part);
  for (const auto& [id, part] : parts.of_submap)
    if (roots.at(parts.component[part]) != part) out[id] = cuts[part];
  return out;
}

}  // namespace tutti::page
