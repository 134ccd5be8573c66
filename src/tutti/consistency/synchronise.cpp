// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/synchronise.hpp"

#include <algorithm>
#include <utility>

namespace tutti::consistency {
namespace {

/// Positions in a list, by stamp; equal stamps stay in the list's order.
struct Stamped {
  Timestamp stamp;
  std::size_t position = 0;
  friend auto operator<=>(const Stamped&, const Stamped&) = default;
};

template <class List, class Wanted>
std::vector<Stamped> by_stamp(const List& list, Wanted wanted) {
  std::vector<Stamped> out;
  for (std::size_t i = 0; i < list.size(); ++i)
    if (wanted(list[i])) out.push_back({list[i].stamp, i});
  std::sort(out.begin(), out.end());
  return out;
}

/// Merges two sorted lists: both(a, b) for equal stamps, one to one; what is left over goes to `only_b`.
template <class Both>
std::vector<Stamped> merge(const std::vector<Stamped>& a, const std::vector<Stamped>& b, Both both) {
  std::vector<Stamped> only_b;
  std::size_t i = 0;
  for (const Stamped& candidate : b) {
    while (i < a.size() && a[i].stamp < candidate.stamp) ++i;
    if (i < a.size() && a[i].stamp == candidate.stamp)
      both(a[i++], candidate);
    else
      only_b.push_back(candidate);
  }
  return only_b;
}

}  // namespace

Synchronisation synchronise(const ProxyGraph& graph, const ChainId& chain, std::span<const RobotNode> nodes) {
  const auto of_chain = [&chain](const auto& node) { return node.chain == chain; };
  const auto proxy = by_stamp(graph.nodes, of_chain);
  const auto removed = by_stamp(graph.eliminated, of_chain);
  const auto ours = by_stamp(nodes, [](const RobotNode&) { return true; });

  Synchronisation out;
  const auto rest = merge(proxy, ours, [&](const Stamped& theirs, const Stamped& own) {
    out.pairs.push_back({theirs.position, own.position});
  });
  merge(removed, rest, [&](const Stamped&, const Stamped& own) { out.eliminated.push_back(own.position); });
  return out;
}

}  // namespace tutti::consistency
