// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/posterior_samples.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti::estimation::internal {
namespace {

/// So many samples at a time: a slab of them stays in registers, a batch of slabs takes one random number per row and
/// bounds the memory.
constexpr int kSlab = 8;
constexpr std::size_t kSlabs = 4;
constexpr std::size_t kBatch = kSlabs * kSlab;
using Slab = Eigen::Matrix<double, 6, kSlab, Eigen::RowMajor>;
using Batch = std::array<Slab, kSlabs>;

/// The block variables that the asked ones depend on: their ancestors in the elimination tree.
std::vector<bool> with_ancestors(const BlockCholesky::Columns& factor, std::span<const int> variables) {
  const std::size_t n = factor.start.size() / 6;
  std::vector<bool> needed(n, false);
  for (const int variable : variables)
    if (variable >= 0) needed[static_cast<std::size_t>(variable)] = true;
  for (std::size_t j = 0; j < n; ++j) {
    const int last_column = factor.start[6 * j + 5];
    if (needed[j] && last_column + 1 < factor.start[6 * j + 6])
      needed[static_cast<std::size_t>(factor.row[last_column + 1] / 6)] = true;
  }
  return needed;
}

void fill_with_random_signs(std::vector<Batch>& Z, Rng& rng) {
  static_assert(kBatch == 32);
  for (Batch& batch : Z)
    for (int row = 0; row < 6; ++row) {
      std::uint64_t bits = rng.index(std::uint64_t{1} << 32U);
      for (Slab& slab : batch)
        for (int column = 0; column < kSlab; ++column, bits >>= 1U) slab(row, column) = (bits & 1U) != 0 ? 1.0 : -1.0;
    }
}

/// Y_j <- L_jj^-T (Y_j - sum over the blocks i below of L_ij^T Y_i). The six columns of a block have the same rows.
void solve_block(const BlockCholesky::Columns& factor, std::size_t j, std::vector<Batch>& Y) {
  const int* start = factor.start.data() + 6 * j;
  const int below = (start[6] - start[5] - 1) / 6;
  for (int b = 0; b < below; ++b) {
    Matrix6d L_ij_transposed;
    for (int c = 0; c < 6; ++c)
      L_ij_transposed.row(c) = Eigen::Map<const Vector6d>(factor.value.data() + start[c] + (6 - c) + 6 * b);
    const Batch& Y_i = Y[static_cast<std::size_t>(factor.row[start[5] + 1 + 6 * b] / 6)];
    for (std::size_t k = 0; k < kSlabs; ++k) Y[j][k].noalias() -= L_ij_transposed.lazyProduct(Y_i[k]);
  }
  for (int c = 5; c >= 0; --c) {
    const double* column = factor.value.data() + start[c];  // from the diagonal down
    for (Slab& slab : Y[j]) {
      for (int d = c + 1; d < 6; ++d) slab.row(c) -= column[d - c] * slab.row(d);
      slab.row(c) /= column[0];
    }
  }
}

}  // namespace

Eigen::MatrixXd posterior_samples(const BlockCholesky::Columns& factor, std::span<const int> variables,
                                  std::size_t count, Rng rng) {
  const std::size_t n = factor.start.size() / 6;
  const std::vector<bool> needed = with_ancestors(factor, variables);
  std::vector<Batch> Y(n);
  Eigen::MatrixXd out =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6 * variables.size()), static_cast<Eigen::Index>(count));
  for (std::size_t first = 0; first < count; first += kBatch) {
    fill_with_random_signs(Y, rng);
    for (std::size_t j = n; j-- > 0;)
      if (needed[j]) solve_block(factor, j, Y);
    for (std::size_t s = 0; s < std::min(kBatch, count - first); ++s)
      for (std::size_t v = 0; v < variables.size(); ++v)
        if (variables[v] >= 0)
          out.col(static_cast<Eigen::Index>(first + s)).segment<6>(static_cast<Eigen::Index>(6 * v)) =
              Y[static_cast<std::size_t>(variables[v])][s / kSlab].col(static_cast<int>(s % kSlab));
  }
  return out;
}

}  // namespace tutti::estimation::internal
