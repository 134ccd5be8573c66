// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/maximum_clique.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace tutti::estimation::internal {
namespace {

using Bits = std::vector<std::uint64_t>;

void set(Bits& bits, int v) { bits[v / 64] |= std::uint64_t{1} << (v % 64); }
void reset(Bits& bits, int v) { bits[v / 64] &= ~(std::uint64_t{1} << (v % 64)); }
int first(const Bits& bits) {
  for (std::size_t w = 0; w < bits.size(); ++w)
    if (bits[w] != 0) return static_cast<int>(64 * w) + std::countr_zero(bits[w]);
  return -1;
}
void intersect(Bits& bits, const std::uint64_t* row) {
  for (std::size_t w = 0; w < bits.size(); ++w) bits[w] &= row[w];
}
void subtract(Bits& bits, const std::uint64_t* row) {
  for (std::size_t w = 0; w < bits.size(); ++w) bits[w] &= ~row[w];
}
int common(const Bits& bits, const std::uint64_t* row) {
  int sum = 0;
  for (std::size_t w = 0; w < bits.size(); ++w) sum += std::popcount(bits[w] & row[w]);
  return sum;
}

class Search {
 public:
  Search(const BitGraph& graph, std::uint64_t max_steps) : graph_(graph), steps_left_(max_steps) {}

  Clique run() {
    Bits all(graph_.words(), 0);
    for (int v = 0; v < graph_.vertices(); ++v) set(all, v);
    grow_from_every_vertex(all);
    const bool finished = expand(core(all));
    std::sort(best_.begin(), best_.end());
    return {best_, finished};
  }

 private:
  /// Adds the candidate with most candidates as neighbours until none is left.
  void grow(std::vector<int>& clique, Bits candidates) const {
    while (true) {
      int chosen = -1;
      int most = -1;
      for (int v = first(candidates); v >= 0; v = next(candidates, v)) {
        const int degree = common(candidates, graph_.row(v));
        if (degree > most) {
          most = degree;
          chosen = v;
        }
      }
      if (chosen < 0) return;
      clique.push_back(chosen);
      intersect(candidates, graph_.row(chosen));
    }
  }

  static int next(const Bits& bits, int v) {
    ++v;
    std::size_t w = static_cast<std::size_t>(v) / 64;
    if (w >= bits.size()) return -1;
    std::uint64_t word = bits[w] & (~std::uint64_t{0} << (v % 64));
    while (word == 0) {
      if (++w == bits.size()) return -1;
      word = bits[w];
    }
    return static_cast<int>(64 * w) + std::countr_zero(word);
  }

  /// Greedy from vertices of every degree, the best result improved.
  void grow_from_every_vertex(const Bits& all) {
    constexpr std::size_t kStarts = 8;
    std::vector<int> order(graph_.vertices());
    std::iota(order.begin(), order.end(), 0);
    std::vector<int> degree(order.size());
    for (int v : order) degree[v] = common(all, graph_.row(v));
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return degree[a] > degree[b]; });
    for (std::size_t k = 0; k < std::min(kStarts, order.size()); ++k) {
      const int start = order[k * order.size() / std::min(kStarts, order.size())];
      std::vector<int> clique{start};
      Bits candidates = all;
      intersect(candidates, graph_.row(start));
      grow(clique, candidates);
      if (clique.size() > best_.size()) best_ = clique;
    }
    while (exchange(best_, all)) {
    }
  }

  /// Drops one member when at least two vertices miss only that one and fit each other. True if the clique grew.
  bool exchange(std::vector<int>& clique, const Bits& all) const {
    for (std::size_t k = 0; k < clique.size(); ++k) {
      Bits candidates = all;
      for (std::size_t other = 0; other < clique.size(); ++other)
        if (other != k) intersect(candidates, graph_.row(clique[other]));
      std::vector<int> grown = clique;
      grown.erase(grown.begin() + static_cast<std::ptrdiff_t>(k));
      for (int member : grown) reset(candidates, member);
      reset(candidates, clique[k]);
      grow(grown, candidates);
      if (grown.size() > clique.size()) {
        clique = grown;
        return true;
      }
    }
    return false;
  }

  /// Without the vertices that have too few neighbours to be in a larger clique than the best one.
  [[nodiscard]] Bits core(Bits candidates) const {
    for (bool changed = true; changed;) {
      changed = false;
      for (int v = first(candidates); v >= 0; v = next(candidates, v)) {
        if (common(candidates, graph_.row(v)) >= static_cast<int>(best_.size())) continue;
        reset(candidates, v);
        changed = true;
      }
    }
    return candidates;
  }

  /// Colours the candidates greedily; a clique has at most one vertex per colour. `order`: by colour, ascending.
  void colour(Bits candidates, std::vector<int>& order, std::vector<int>& colours) const {
    for (int c = 1; first(candidates) >= 0; ++c) {
      Bits independent = candidates;
      for (int v = first(independent); v >= 0; v = next(independent, v)) {
        subtract(independent, graph_.row(v));
        reset(candidates, v);
        order.push_back(v);
        colours.push_back(c);
      }
    }
  }

  /// False when out of steps.
  bool expand(Bits candidates) {
    std::vector<int> order;
    std::vector<int> colours;
    colour(candidates, order, colours);
    if (order.size() > steps_left_) return false;
    steps_left_ -= order.size();
    for (std::size_t k = order.size(); k-- > 0;) {
      if (current_.size() + static_cast<std::size_t>(colours[k]) <= best_.size()) return true;
      current_.push_back(order[k]);
      Bits inner = candidates;
      intersect(inner, graph_.row(order[k]));
      bool finished = true;
      if (first(inner) >= 0)
        finished = expand(inner);
      else if (current_.size() > best_.size())
        best_ = current_;
      current_.pop_back();
      if (!finished) return false;
      reset(candidates, order[k]);
    }
    return true;
  }

  const BitGraph& graph_;
  std::uint64_t steps_left_;
  std::vector<int> current_;
  std::vector<int> best_;
};

}  // namespace

Clique maximum_clique(const BitGraph& graph, std::uint64_t max_steps) {
  if (graph.vertices() == 0) return {{}, true};
  return Search(graph, max_steps).run();
}

}  // namespace tutti::estimation::internal
