// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/internal/row_blocks.hpp"

#include <algorithm>

#include "tutti/spectral/internal/bandwidth.hpp"

namespace tutti::spectral::internal {
namespace {

using Rows = Eigen::Array<double, RowBlocks::kRows, 1>;

/// Rows of M times x.
inline Rows multiply_rows(const int* column, int columns, const double* m, const double* x) {
  Rows even = Rows::Zero();  // two sums, because one would wait for itself
  Rows odd = Rows::Zero();
  int k = 0;
  for (; k + 2 <= columns; k += 2, m += 2 * RowBlocks::kRows) {
    even += Rows::Map(m) * x[column[k]];
    odd += Rows::Map(m + RowBlocks::kRows) * x[column[k + 1]];
  }
  if (k < columns) even += Rows::Map(m) * x[column[k]];
  return even + odd;
}

}  // namespace

RowBlocks::RowBlocks(const SparseMatrix& matrix) : node_(bandwidth_reducing_order(matrix)) {
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
      coefficient_[*next_slot++ * kRows + row % kRows] = it.value();
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

void RowBlocks::step(double scale, double shift, const Eigen::VectorXd& x, Eigen::VectorXd& y,
                     std::span<const double> weights, Eigen::MatrixXd& sums) const {
  const int* start = start_.data();
  for (std::size_t block = 0; block + 1 < start_.size(); ++block) {
    const std::size_t row = block * kRows;
    auto y_rows = Rows::Map(y.data() + row);
    const Rows product = multiply_rows(column_.data() + start[block], start[block + 1] - start[block],
                                       coefficient_.data() + std::ptrdiff_t{start[block]} * kRows, x.data());
    const Rows next = scale * product + (shift * Rows::Map(x.data() + row) - y_rows);
    y_rows = next;
    for (std::size_t s = 0; s < weights.size(); ++s)
      Rows::Map(sums.data() + s * static_cast<std::size_t>(sums.rows()) + row) += weights[s] * next;
  }
}

void RowBlocks::step(double scale, double shift, const Eigen::VectorXd& x, Eigen::VectorXd& y) const {
  Eigen::MatrixXd none;
  step(scale, shift, x, y, {}, none);
}

}  // namespace tutti::spectral::internal
