// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/dissection.hpp"

#include <algorithm>
#include <numeric>

namespace tutti::estimation::internal {
namespace {

constexpr double kLargestSide = 0.67;

class Dissection {
 public:
  explicit Dissection(const Adjacency& graph)
      : graph_(graph), region_(graph.vertices(), 0), level_(graph.vertices(), -1) {}

  std::vector<int> order() {
    std::vector<int> all(graph_.vertices());
    std::iota(all.begin(), all.end(), 0);
    push(std::move(all));
    while (!stack_.empty()) {
      const auto vertices = std::move(stack_.back());
      stack_.pop_back();
      split(vertices);
    }
    std::reverse(reversed_.begin(), reversed_.end());
    return std::move(reversed_);
  }

 private:
  void push(std::vector<int> vertices) {
    if (vertices.empty()) return;
    ++regions_;
    for (const int v : vertices) region_[v] = regions_;
    stack_.push_back(std::move(vertices));
  }

  /// Fills queue_ with the vertices reached, and their level_. Returns the number of levels.
  int search_from(int first) {
    for (const int v : queue_) level_[v] = -1;
    queue_.assign(1, first);
    level_[first] = 0;
    for (std::size_t k = 0; k < queue_.size(); ++k) {
      const int v = queue_[k];
      for (const int u : graph_.of(v)) {
        if (region_[u] != region_[first] || level_[u] >= 0) continue;
        level_[u] = level_[v] + 1;
        queue_.push_back(u);
      }
    }
    return level_[queue_.back()] + 1;
  }

  /// The best level to cut after: its vertices with neighbours in the next one separate.
  int best_cut(int levels) {
    std::vector<int> size(levels, 0);
    std::vector<int> separator(levels, 0);
    for (const int v : queue_) {
      ++size[level_[v]];
      separator[level_[v]] += is_on_border(v) ? 1 : 0;
    }
    const int all = static_cast<int>(queue_.size());
    int best = 1;
    double least = -1.0;
    for (int k = 1, reached = size[0]; k + 1 < levels; ++k) {
      reached += size[k];
      const double side = static_cast<double>(std::max(reached - separator[k], all - reached)) / all;
      const double cost = separator[k] + side + (side > kLargestSide ? all * side : 0.0);
      if (least >= 0.0 && cost >= least) continue;
      least = cost;
      best = k;
    }
    return best;
  }

  [[nodiscard]] bool is_on_border(int v) const {
    const auto next = graph_.of(v);
    return std::any_of(next.begin(), next.end(),
                       [&](int u) { return region_[u] == region_[v] && level_[u] > level_[v]; });
  }

  void split(const std::vector<int>& vertices) {
    int levels = search_from(vertices.front());
    std::vector<int> below;
    std::vector<int> above;
    if (queue_.size() < vertices.size()) {  // not connected
      for (const int v : vertices) (level_[v] >= 0 ? below : above).push_back(v);
    } else {
      if (levels > 2) levels = search_from(queue_.back());
      if (levels < 3) {
        reversed_.insert(reversed_.end(), vertices.rbegin(), vertices.rend());
        return;
      }
      const int cut = best_cut(levels);
      for (const int v : vertices) {
        if (level_[v] == cut && is_on_border(v))
          reversed_.push_back(v);
        else
          (level_[v] <= cut ? below : above).push_back(v);
      }
    }
    push(std::move(below));
    push(std::move(above));
  }

  const Adjacency& graph_;
  std::vector<int> region_, level_, queue_;
  std::vector<std::vector<int>> stack_;
  std::vector<int> reversed_;
  int regions_ = 0;
};

}  // namespace

Adjacency make_adjacency(int vertices, std::span<const std::pair<int, int>> edges) {
  Adjacency out;
  out.start.assign(vertices + 1, 0);
  for (const auto& [a, b] : edges) ++out.start[a + 1], ++out.start[b + 1];
  std::partial_sum(out.start.begin(), out.start.end(), out.start.begin());
  out.neighbour.resize(2 * edges.size());
  std::vector<int> next(out.start.begin(), out.start.end() - 1);
  for (const auto& [a, b] : edges) {
    out.neighbour[next[a]++] = b;
    out.neighbour[next[b]++] = a;
  }
  return out;
}

std::vector<int> dissect(const Adjacency& graph) { return Dissection(graph).order(); }

}  // namespace tutti::estimation::internal
