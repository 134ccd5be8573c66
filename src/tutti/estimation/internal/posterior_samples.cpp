// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/posterior_samples.hpp"

#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti::estimation::internal {
namespace {

/// So many samples are solved for at a time: one block of them stays in registers.
constexpr int kWidth = 8;
using Slab = Eigen::Matrix<double, 6, kWidth, Eigen::RowMajor>;

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

/// Z, a row of slabs per block variable.
std::vector<Slab> random_signs(std::size_t variables, std::size_t slabs, Rng& rng) {
  static_assert(32 % kWidth == 0);
  std::vector<Slab> out(variables * slabs);
  for (std::size_t j = 0; j < variables; ++j)
    for (int row = 0; row < 6; ++row) {
      std::uint64_t bits = 0;
      for (std::size_t k = 0; k < slabs; ++k) {
        if (k % (32 / kWidth) == 0) bits = rng.index(std::uint64_t{1} << 32U);
        for (int column = 0; column < kWidth; ++column, bits >>= 1U)
          out[j * slabs + k](row, column) = (bits & 1U) != 0 ? 1.0 : -1.0;
      }
    }
  return out;
}

/// Y_j <- L_jj^-T (Y_j - sum over the blocks i below of L_ij^T Y_i). The six columns of a block have the same rows.
void solve_block(const BlockCholesky::Columns& factor, std::size_t j, std::size_t slabs, std::vector<Slab>& Y) {
  const int* start = factor.start.data() + 6 * j;
  const int below = (start[6] - start[5] - 1) / 6;
  Slab* const target = Y.data() + j * slabs;
  for (int b = 0; b < below; ++b) {
    Matrix6d L_ij_transposed;
    for (int c = 0; c < 6; ++c)
      L_ij_transposed.row(c) = Eigen::Map<const Vector6d>(factor.value.data() + start[c] + (6 - c) + 6 * b);
    const Slab* const source = Y.data() + static_cast<std::size_t>(factor.row[start[5] + 1 + 6 * b] / 6) * slabs;
    for (std::size_t k = 0; k < slabs; ++k) target[k].noalias() -= L_ij_transposed.lazyProduct(source[k]);
  }
  for (int c = 5; c >= 0; --c) {
    const double* column = factor.value.data() + start[c];
    for (std::size_t k = 0; k < slabs; ++k) {
      for (int d = c + 1; d < 6; ++d) target[k].row(c) -= column[d - c] * target[k].row(d);
      target[k].row(c) /= column[0];
    }
  }
}

}  // namespace

Eigen::MatrixXd posterior_samples(const BlockCholesky::Columns& factor, std::span<const int> variables,
                                  std::size_t count, Rng rng) {
  const std::size_t n = factor.start.size() / 6;
  const std::size_t slabs = (count + kWidth - 1) / kWidth;
  const std::vector<bool> needed = with_ancestors(factor, variables);
  std::vector<Slab> Y = random_signs(n, slabs, rng);
  for (std::size_t j = n; j-- > 0;)
    if (needed[j]) solve_block(factor, j, slabs, Y);

  Eigen::MatrixXd out =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6 * variables.size()), static_cast<Eigen::Index>(count));
  for (std::size_t v = 0; v < variables.size(); ++v) {
    if (variables[v] < 0) continue;
    for (std::size_t s = 0; s < count; ++s)
      out.col(static_cast<Eigen::Index>(s)).segment<6>(static_cast<Eigen::Index>(6 * v)) =
          Y[static_cast<std::size_t>(variables[v]) * slabs + s / kWidth].col(static_cast<int>(s % kWidth));
  }
  return out;
}

}  // namespace tutti::estimation::internal
