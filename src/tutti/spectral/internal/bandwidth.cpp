// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/internal/bandwidth.hpp"

#include <algorithm>

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

}  // namespace tutti::spectral::internal
