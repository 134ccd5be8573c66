// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/spectral/internal/row_blocks.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

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

RowBlocks::RowBlocks(const SparseMatrix& matrix)
    : node_(gather_neighbours(matrix, bandwidth_reducing_order(matrix), kRows)) {
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
    for (int at = start_.back(); at < static_cast<int>(column_.size()); ++at)
      reach_ = std::max<std::ptrdiff_t>(reach_, std::abs(column_[static_cast<std::size_t>(at)] / kRows - block));
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

void RowBlocks::step_rows(const Step& step, std::ptrdiff_t begin, std::ptrdiff_t end, const double* x, double* y,
                          Eigen::MatrixXd& sums) const {
  const int* start = start_.data();
  for (std::ptrdiff_t block = begin; block < end; ++block) {
    const std::ptrdiff_t row = block * kRows;
    auto y_rows = Rows::Map(y + row);
    const Rows product = multiply_rows(column_.data() + start[block], start[block + 1] - start[block],
                                       coefficient_.data() + std::ptrdiff_t{start[block]} * kRows, x);
    const Rows next = step.scale * product + (step.shift * Rows::Map(x + row) - y_rows);
    y_rows = next;
    for (std::size_t s = 0; s < step.weights.size(); ++s)
      Rows::Map(sums.data() + static_cast<std::ptrdiff_t>(s) * sums.rows() + row) += step.weights[s] * next;
  }
}

RowBlocks::Wave RowBlocks::wave(std::size_t cache_bytes) const {
  const std::size_t blocks = start_.size() - 1;
  constexpr std::size_t kVectors = 8;  // two, and some sums
  const std::size_t bytes =
      column_.size() * (sizeof(int) + kRows * sizeof(double)) + blocks * kVectors * kRows * sizeof(double);
  Wave out{.rows = static_cast<std::ptrdiff_t>(blocks), .reach = reach_};
  if (bytes <= cache_bytes) return out;
  // Half of the cache for the rows, half for those that the steps lie behind each other.
  const auto cached = static_cast<std::ptrdiff_t>(static_cast<double>(cache_bytes) / static_cast<double>(bytes) *
                                                  static_cast<double>(blocks));
  const std::ptrdiff_t steps = cached / 2 / std::max<std::ptrdiff_t>(reach_, 1);
  if (steps < 2) return out;
  out.steps = static_cast<std::size_t>(steps);
  out.rows = cached / 2;
  return out;
}

void RowBlocks::run(std::span<const Step> steps, Eigen::VectorXd& x, Eigen::VectorXd& y, Eigen::MatrixXd& sums,
                    std::size_t cache_bytes) const {
  const auto blocks = static_cast<std::ptrdiff_t>(start_.size()) - 1;
  const Wave how = wave(cache_bytes);
  while (!steps.empty()) {
    const auto now = steps.first(std::min(how.steps, steps.size()));
    const auto last_behind = static_cast<std::ptrdiff_t>(now.size() - 1) * how.reach;
    for (std::ptrdiff_t begin = 0; begin < blocks + last_behind; begin += how.rows) {
      // Step t reads what step t - 1 left up to `reach` blocks further on, and writes where no step needs t - 2.
      double *from = x.data(), *to = y.data();
      for (std::size_t t = 0; t < now.size(); ++t, std::swap(from, to)) {
        const std::ptrdiff_t behind = static_cast<std::ptrdiff_t>(t) * how.reach;
        step_rows(now[t], std::clamp<std::ptrdiff_t>(begin - behind, 0, blocks),
                  std::clamp<std::ptrdiff_t>(begin + how.rows - behind, 0, blocks), from, to, sums);
      }
    }
    if (now.size() % 2 == 1) x.swap(y);
    steps = steps.subspan(now.size());
  }
}

void RowBlocks::step(double scale, double shift, const Eigen::VectorXd& x, Eigen::VectorXd& y) const {
  Eigen::MatrixXd none;
  step_rows({scale, shift, {}}, 0, static_cast<std::ptrdiff_t>(start_.size()) - 1, x.data(), y.data(), none);
}

}  // namespace tutti::spectral::internal
