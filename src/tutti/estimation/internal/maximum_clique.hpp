// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

namespace tutti::estimation::internal {

/// Undirected graph without loops, one bit per pair.
class BitGraph {
 public:
  explicit BitGraph(int vertices) : vertices_(vertices), words_((vertices + 63) / 64), bits_(vertices_ * words_, 0) {}

  void connect(int a, int b) {
    row(a)[b / 64] |= std::uint64_t{1} << (b % 64);
    row(b)[a / 64] |= std::uint64_t{1} << (a % 64);
  }
  [[nodiscard]] bool connected(int a, int b) const { return (row(a)[b / 64] >> (b % 64)) & 1U; }
  [[nodiscard]] int vertices() const { return static_cast<int>(vertices_); }
  [[nodiscard]] int words() const { return static_cast<int>(words_); }
  [[nodiscard]] const std::uint64_t* row(int a) const { return bits_.data() + a * words_; }

 private:
  std::uint64_t* row(int a) { return bits_.data() + a * words_; }

  std::size_t vertices_;
  std::size_t words_;
  std::vector<std::uint64_t> bits_;
};

struct Clique {
  std::vector<int> vertices;  ///< Increasing.
  bool is_maximum = false;    ///< Proved; false when the search ran out of steps.
};

/// A greedy clique, improved by exchanging one vertex for two, then branch and bound with colouring (Tomita & Seki
/// 2003; bitsets as in San Segundo 2011) for at most `max_steps` colourings of a vertex. Deterministic.
Clique maximum_clique(const BitGraph& graph, std::uint64_t max_steps);

}  // namespace tutti::estimation::internal
