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
bool contains(const Bits& bits, int v) { return ((bits[v / 64] >> (v % 64)) & 1U) != 0; }
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
/// std::popcount is a call into the compiler's library when the target has no instruction for it.
int count(std::uint64_t word) {
  word -= (word >> 1U) & 0x5555555555555555ULL;
  word = (word & 0x3333333333333333ULL) + ((word >> 2U) & 0x3333333333333333ULL);
  word = (word + (word >> 4U)) & 0x0f0f0f0f0f0f0f0fULL;
  return static_cast<int>((word * 0x0101010101010101ULL) >> 56U);
}
int common(const Bits& bits, const std::uint64_t* row) {
  int sum = 0;
  for (std::size_t w = 0; w < bits.size(); ++w) sum += count(bits[w] & row[w]);
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
  /// Adds the candidate with most candidates as neighbours until none is left. Degrees are kept up to date: every
  /// vertex that drops out takes one from its neighbours'.
  void grow(std::vector<int>& clique, Bits candidates) const {
    std::vector<int> degree(static_cast<std::size_t>(graph_.vertices()), 0);
    for (int v = first(candidates); v >= 0; v = next(candidates, v)) degree[v] = common(candidates, graph_.row(v));
    while (true) {
      int chosen = -1;
      int most = -1;
      for (int v = first(candidates); v >= 0; v = next(candidates, v)) {
        if (degree[v] <= most) continue;
        most = degree[v];
        chosen = v;
      }
      if (chosen < 0) return;
      clique.push_back(chosen);
      Bits gone = candidates;
      subtract(gone, graph_.row(chosen));
      intersect(candidates, graph_.row(chosen));
      for (int v = first(gone); v >= 0; v = next(gone, v)) {
        Bits neighbours = candidates;
        intersect(neighbours, graph_.row(v));
        for (int u = first(neighbours); u >= 0; u = next(neighbours, u)) --degree[u];
      }
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
    Bits members(all.size(), 0);
    for (const int member : clique) set(members, member);
    std::vector<Bits> missing_only(clique.size());  // per member
    for (int v = first(all); v >= 0; v = next(all, v)) {
      if (contains(members, v) || common(members, graph_.row(v)) + 1 != static_cast<int>(clique.size())) continue;
      const auto missed = std::ranges::find_if(clique, [&](int member) { return !graph_.connected(v, member); });
      Bits& candidates = missing_only[static_cast<std::size_t>(missed - clique.begin())];
      candidates.resize(all.size(), 0);
      set(candidates, v);
    }
    for (std::size_t k = 0; k < clique.size(); ++k) {
      if (missing_only[k].empty()) continue;
      std::vector<int> grown = clique;
      grown.erase(grown.begin() + static_cast<std::ptrdiff_t>(k));
      grow(grown, missing_only[k]);
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
