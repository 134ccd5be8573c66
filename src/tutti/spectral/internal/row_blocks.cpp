// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/internal/row_blocks.hpp"

#include <algorithm>

namespace tutti::spectral::internal {
namespace {

/// Reverse Cuthill-McKee: breadth first, nodes of small degree first. Components follow one another.
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

/// y = M x - y and sums += weights y, plainly enough for compilers to use the vector registers of any processor: 5 us
/// for 1600 nodes of 28 neighbours with SSE2, 3.9 us if compiled for AVX-512 (not worth a dispatch, and the same bits
/// follow everywhere), against 20 us of Eigen's product.
void step(const int* start, int blocks, const int* column, const double* coefficient, const double* x, double* y,
          const double* weights, int sums, double* sum, std::ptrdiff_t sum_stride) {
  constexpr int kRows = RowBlocks::kRows;
  for (int block = 0; block < blocks; ++block) {
    double even[kRows], odd[kRows];  // two sums, because one would wait for itself
    for (int r = 0; r < kRows; ++r) even[r] = -y[block * kRows + r];
    for (int r = 0; r < kRows; ++r) odd[r] = 0.0;
    int k = start[block];
    const int end = start[block + 1];
    for (; k + 2 <= end; k += 2) {
      const double* m = coefficient + std::ptrdiff_t{k} * kRows;
      for (int r = 0; r < kRows; ++r) even[r] += m[r] * x[column[k]];
      for (int r = 0; r < kRows; ++r) odd[r] += m[kRows + r] * x[column[k + 1]];
    }
    if (k < end)
      for (int r = 0; r < kRows; ++r) even[r] += coefficient[std::ptrdiff_t{k} * kRows + r] * x[column[k]];
    for (int r = 0; r < kRows; ++r) even[r] += odd[r];
    for (int r = 0; r < kRows; ++r) y[block * kRows + r] = even[r];
    for (int s = 0; s < sums; ++s) {
      double* out = sum + s * sum_stride + block * kRows;
      const double weight = weights[s];
      for (int r = 0; r < kRows; ++r) out[r] += weight * even[r];
    }
  }
}

}  // namespace

RowBlocks::RowBlocks(const SparseMatrix& matrix, double scale, double shift) : node_(bandwidth_reducing_order(matrix)) {
  const int nodes = static_cast<int>(matrix.cols());
  std::vector<int> place(node_.size());
  for (int n = 0; n < nodes; ++n) place[static_cast<std::size_t>(node_[static_cast<std::size_t>(n)])] = n;

  // First the columns of every block, then, into the slot found for each, the coefficients.
  const int blocks = (nodes + kRows - 1) / kRows;
  start_.assign(1, 0);
  std::vector<int> slot_of(node_.size(), -1);
  std::vector<int> slot;
  slot.reserve(static_cast<std::size_t>(matrix.nonZeros()));
  for (int block = 0; block < blocks; ++block) {
    for (int row = block * kRows; row < std::min(nodes, (block + 1) * kRows); ++row) {
      for (SparseMatrix::InnerIterator it(matrix, node_[static_cast<std::size_t>(row)]); it; ++it) {
        const int other = place[static_cast<std::size_t>(it.row())];
        int& known = slot_of[static_cast<std::size_t>(other)];
        if (known < start_.back()) {
          known = static_cast<int>(column_.size());
          column_.push_back(other);
        }
        slot.push_back(known);
      }
    }
    start_.push_back(static_cast<int>(column_.size()));
  }
  coefficient_.setZero(static_cast<Eigen::Index>(column_.size()) * kRows);
  auto next_slot = slot.begin();
  for (int row = 0; row < nodes; ++row) {
    for (SparseMatrix::InnerIterator it(matrix, node_[static_cast<std::size_t>(row)]); it; ++it)
      coefficient_[*next_slot++ * kRows + row % kRows] = scale * it.value() + (it.row() == it.col() ? shift : 0.0);
  }
}

Eigen::VectorXd RowBlocks::to_blocks(const Eigen::Ref<const Eigen::VectorXd>& nodes) const {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(size());
  for (std::size_t n = 0; n < node_.size(); ++n) out[static_cast<Eigen::Index>(n)] = nodes[node_[n]];
  return out;
}

void RowBlocks::from_blocks(const Eigen::Ref<const Eigen::VectorXd>& blocks, Eigen::Ref<Eigen::VectorXd> nodes) const {
  for (std::size_t n = 0; n < node_.size(); ++n) nodes[node_[n]] = blocks[static_cast<Eigen::Index>(n)];
}

void RowBlocks::multiply_subtract(const Eigen::VectorXd& x, Eigen::VectorXd& y) const {
  step(start_.data(), static_cast<int>(start_.size()) - 1, column_.data(), coefficient_.data(), x.data(), y.data(),
       nullptr, 0, nullptr, 0);
}

void RowBlocks::chebyshev_step(const Eigen::VectorXd& x, Eigen::VectorXd& y, std::span<const double> weights,
                               Eigen::MatrixXd& sums) const {
  step(start_.data(), static_cast<int>(start_.size()) - 1, column_.data(), coefficient_.data(), x.data(), y.data(),
       weights.data(), static_cast<int>(weights.size()), sums.data(), sums.rows());
}

}  // namespace tutti::spectral::internal
