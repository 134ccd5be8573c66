// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/closure_groups.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

namespace tutti::judge {
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

/// Closures not yet in a group, by when their ends were seen: those near one lie in its cell or in one beside that.
class Cells {
 public:
  Cells(const std::vector<Ends>& ends, double near_s) : ends_(ends), near_s_(near_s) {
    constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max() / 4;  // no neighbour overflows
    side_ns_ = std::clamp<std::int64_t>(to_nanoseconds(near_s), 0, kMost) + 1;
    for (std::size_t k = 0; k < ends.size(); ++k) cells_[cell_of(ends[k])].push_back(k);
  }

  void take(std::size_t closure) { std::erase(cells_[cell_of(ends_[closure])], closure); }

  /// Moves those near this one to the end of the group.
  void take_near(std::size_t closure, std::vector<std::size_t>& group) {
    const Cell at = cell_of(ends_[closure]);
    for (const std::int64_t first : {-1, 0, 1})
      for (const std::int64_t second : {-1, 0, 1}) {
        const auto cell = cells_.find({at.first, at.second, at.first_side + first, at.second_side + second});
        if (cell == cells_.end()) continue;
        const auto near = std::ranges::partition(
            cell->second, [&](std::size_t other) { return !is_near(ends_[closure], ends_[other], near_s_); });
        group.insert(group.end(), near.begin(), near.end());
        cell->second.erase(near.begin(), near.end());
      }
  }

 private:
  struct Cell {
    ChainId first, second;
    std::int64_t first_side = 0, second_side = 0;
    friend auto operator<=>(const Cell&, const Cell&) = default;
  };
  [[nodiscard]] std::int64_t side_of(Timestamp stamp) const {
    return stamp.ns / side_ns_ - (stamp.ns % side_ns_ < 0 ? 1 : 0);
  }
  [[nodiscard]] Cell cell_of(const Ends& ends) const {
    return {ends.chains[0], ends.chains[1], side_of(ends.stamps[0]), side_of(ends.stamps[1])};
  }

  const std::vector<Ends>& ends_;
  double near_s_;
  std::int64_t side_ns_ = 1;
  std::map<Cell, std::vector<std::size_t>> cells_;
};

/// All of a group are between the same two chains.
bool is_longer(const std::vector<std::size_t>& group, const std::vector<Ends>& ends, double most_s) {
  for (const int end : {0, 1}) {
    const auto [first, last] =
        std::ranges::minmax(group, {}, [&](std::size_t closure) { return ends[closure].stamps[end]; });
    if (ends[last].stamps[end] - ends[first].stamps[end] > most_s) return true;
  }
  return false;
}

}  // namespace

std::vector<std::vector<std::size_t>> closure_groups(const std::vector<MapNode>& nodes,
                                                     std::span<const PoseGraphEdge> edges,
                                                     std::span<const std::size_t> closures, const GroupLimits& limits) {
  std::vector<Ends> ends;
  for (const std::size_t e : closures) ends.push_back(ends_of(nodes, edges[e]));
  Cells cells(ends, limits.near_s);
  std::vector<bool> taken(closures.size(), false);
  std::vector<std::vector<std::size_t>> out;
  for (std::size_t first = 0; first < closures.size(); ++first) {
    if (taken[first]) continue;
    std::vector<std::size_t> group = {first};  // positions in `closures`
    cells.take(first);
    for (std::size_t k = 0; k < group.size(); ++k) cells.take_near(group[k], group);
    for (const std::size_t k : group) taken[k] = true;
    if (group.size() > limits.most_closures || is_longer(group, ends, limits.longest_s)) continue;
    std::ranges::sort(group);
    for (std::size_t& k : group) k = closures[k];
    out.push_back(std::move(group));
  }
  return out;
}

}  // namespace tutti::judge
