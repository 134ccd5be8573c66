// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/internal/bandwidth.hpp"

#include <algorithm>
#include <optional>

namespace tutti::spectral::internal {

std::vector<int> bandwidth_reducing_order(const SparseMatrix& matrix) {
  const auto nodes = static_cast<std::size_t>(matrix.cols());
  const int* start = matrix.outerIndexPtr();
  const auto by_degree = [&](int a, int b) {
    const int degree_a = start[a + 1] - start[a];
    const int degree_b = start[b + 1] - start[b];
    return degree_a != degree_b ? degree_a < degree_b : a < b;
  };
  std::vector<int> seeds(nodes);
  for (std::size_t n = 0; n < nodes; ++n) seeds[n] = static_cast<int>(n);
  std::sort(seeds.begin(), seeds.end(), by_degree);
  std::vector<int> order;
  order.reserve(nodes);
  std::vector<char> seen(nodes, 0);
  std::size_t front = 0;
  for (const int seed : seeds) {
    if (seen[static_cast<std::size_t>(seed)] != 0) continue;
    seen[static_cast<std::size_t>(seed)] = 1;
    order.push_back(seed);
    for (; front < order.size(); ++front) {
      const auto first_child = static_cast<std::ptrdiff_t>(order.size());
      for (int k = start[order[front]]; k < start[order[front] + 1]; ++k) {
        const int neighbour = matrix.innerIndexPtr()[k];
        if (seen[static_cast<std::size_t>(neighbour)] != 0) continue;
        seen[static_cast<std::size_t>(neighbour)] = 1;
        order.push_back(neighbour);
      }
      std::sort(order.begin() + first_child, order.end(), by_degree);
    }
  }
  std::reverse(order.begin(), order.end());
  return order;
}

namespace {

/// A group that grows.
class Group {
 public:
  Group(const SparseMatrix& matrix, std::vector<int>& taken)
      : matrix_(matrix), taken_(taken), is_taken_(static_cast<std::size_t>(matrix.cols())), pull_(is_taken_.size()) {}
  [[nodiscard]] bool is_taken(int node) const { return is_taken_[static_cast<std::size_t>(node)]; }
  void take(int node) {
    is_taken_[static_cast<std::size_t>(node)] = true;
    taken_.push_back(node);
    for (SparseMatrix::InnerIterator it(matrix_, node); it; ++it) {
      const int other = static_cast<int>(it.row());
      if (other == node || is_taken(other)) continue;
      double& pull = pull_[static_cast<std::size_t>(other)];
      if (pull == 0.0) beside_.push_back(other);
      pull -= it.value();
    }
  }
  /// The node beside the group that is drawn to it most; none when there is none.
  [[nodiscard]] std::optional<int> next() const {
    std::optional<int> best;
    for (const int node : beside_)
      if (!is_taken(node) && (!best || pull_[static_cast<std::size_t>(node)] > pull_[static_cast<std::size_t>(*best)]))
        best = node;
    return best;
  }
  void end() {
    for (const int node : beside_) pull_[static_cast<std::size_t>(node)] = 0.0;
    beside_.clear();
  }

 private:
  const SparseMatrix& matrix_;
  std::vector<int>& taken_;
  std::vector<bool> is_taken_;
  std::vector<double> pull_;  // by node: the weights of its edges into the group
  std::vector<int> beside_;
};

}  // namespace

std::vector<int> gather_neighbours(const SparseMatrix& matrix, const std::vector<int>& order, int count) {
  std::vector<int> out;
  out.reserve(order.size());
  Group group(matrix, out);
  auto left = order.begin();
  while (out.size() < order.size()) {
    if (out.size() % static_cast<std::size_t>(count) == 0) group.end();
    const auto next = group.next();
    if (!next) left = std::find_if(left, order.end(), [&](int node) { return !group.is_taken(node); });
    group.take(next ? *next : *left);
  }
  return out;
}

}  // namespace tutti::spectral::internal
