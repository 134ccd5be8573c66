// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/posterior_samples.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti::estimation::internal {
namespace {

/// So many samples at a time: a slab of them stays in registers, a batch of slabs bounds the memory.
constexpr int kSlab = 8;
constexpr std::size_t kSlabs = 4;
constexpr std::size_t kBatch = kSlabs * kSlab;
using Slab = Eigen::Matrix<double, 6, kSlab, Eigen::RowMajor>;
using Batch = std::array<Slab, kSlabs>;

/// The block variables that the asked ones depend on: their ancestors in the elimination tree.
std::vector<bool> with_ancestors(const CholeskyFactor& factor, std::span<const int> variables) {
  const std::size_t n = factor.block_columns();
  std::vector<bool> needed(n, false);
  for (const int variable : variables)
    if (variable >= 0) needed[static_cast<std::size_t>(variable)] = true;
  for (std::size_t j = 0; j < n; ++j)
    if (needed[j])
      if (const auto parent = CholeskyFactor::Column(factor, j).parent()) needed[*parent] = true;
  return needed;
}

/// A sum of 64 random signs over its standard deviation: a normal number for all that is asked of samples, and cheap.
double nearly_normal(std::uint64_t number) { return (std::popcount(mixed(number)) - 32) / 4.0; }

void fill_at_random(std::uint64_t stream, std::size_t j, Batch& batch) {
  std::uint64_t number = stream + j * std::uint64_t{6 * kBatch};
  for (Slab& slab : batch)
    for (double& value : slab.reshaped()) value = nearly_normal(++number);
}

/// Y_j <- L_jj^-T (Y_j - sum over the blocks i below of L_ij^T Y_i).
void solve_block(const CholeskyFactor& factor, std::size_t j, std::vector<Batch>& Y) {
  const CholeskyFactor::Column column(factor, j);
  for (int b = 0; b < column.below(); ++b) {
    const Matrix6d L_ij_transposed = column.block(b).transpose();
    const Batch& Y_i = Y[column.row(b)];
    for (std::size_t k = 0; k < kSlabs; ++k) Y[j][k].noalias() -= L_ij_transposed.lazyProduct(Y_i[k]);
  }
  const auto L_jj = column.diagonal();
  for (int c = 5; c >= 0; --c)
    for (Slab& slab : Y[j]) {
      for (int d = c + 1; d < 6; ++d) slab.row(c) -= L_jj(d, c) * slab.row(d);
      slab.row(c) /= L_jj(c, c);
    }
}

}  // namespace

Eigen::MatrixXd posterior_samples(const CholeskyFactor& factor, std::span<const int> variables, std::size_t count,
                                  Rng rng) {
  const std::size_t n = factor.block_columns();
  const std::vector<bool> needed = with_ancestors(factor, variables);
  std::vector<Batch> Y(n);
  Eigen::MatrixXd out =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6 * variables.size()), static_cast<Eigen::Index>(count));
  for (std::size_t first = 0; first < count; first += kBatch) {
    const std::uint64_t stream = rng.index(~std::uint64_t{0});
    for (std::size_t j = n; j-- > 0;) {
      if (!needed[j]) continue;
      fill_at_random(stream, j, Y[j]);
      solve_block(factor, j, Y);
    }
    for (std::size_t s = 0; s < std::min(kBatch, count - first); ++s)
      for (std::size_t v = 0; v < variables.size(); ++v)
        if (variables[v] >= 0)
          out.col(static_cast<Eigen::Index>(first + s)).segment<6>(static_cast<Eigen::Index>(6 * v)) =
              Y[static_cast<std::size_t>(variables[v])][s / kSlab].col(static_cast<int>(s % kSlab));
  }
  return out;
}

Eigen::MatrixXd posterior_covariance(const CholeskyFactor& factor, std::span<const int> variables) {
  std::vector<Matrix6d> y(factor.block_columns(), Matrix6d::Zero());
  struct Path {
    std::vector<std::size_t> block;  // ascending
    std::vector<Matrix6d> y;
  };
  std::vector<Path> paths(variables.size());
  for (std::size_t v = 0; v < variables.size(); ++v) {
    if (variables[v] < 0) continue;
    Path& path = paths[v];
    y[static_cast<std::size_t>(variables[v])].setIdentity();
    for (std::optional<std::size_t> j = static_cast<std::size_t>(variables[v]); j;) {
      const CholeskyFactor::Column column(factor, *j);
      const auto L_jj = column.diagonal();
      Matrix6d& y_j = y[*j];
      for (int c = 0; c < 6; ++c) {
        y_j.row(c) /= L_jj(c, c);
        for (int d = c + 1; d < 6; ++d) y_j.row(d) -= L_jj(d, c) * y_j.row(c);
      }
      for (int b = 0; b < column.below(); ++b) {
        const auto L_ij = column.block(b);
        Matrix6d& y_i = y[column.row(b)];
        for (int c = 0; c < 6; ++c) y_i.noalias() -= L_ij.col(c) * y_j.row(c);
      }
      path.block.push_back(*j);
      path.y.push_back(y_j);
      j = column.parent();
    }
    for (const std::size_t j : path.block) y[j].setZero();
  }
  const auto size = static_cast<Eigen::Index>(6 * variables.size());
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(size, size);
  for (std::size_t a = 0; a < paths.size(); ++a)
    for (std::size_t b = a; b < paths.size(); ++b) {
      Matrix6d sum = Matrix6d::Zero();
      for (std::size_t i = 0, k = 0; i < paths[a].block.size() && k < paths[b].block.size();) {
        if (paths[a].block[i] == paths[b].block[k])
          sum.noalias() += paths[a].y[i++].transpose() * paths[b].y[k++];
        else
          paths[a].block[i] < paths[b].block[k] ? ++i : ++k;
      }
      const auto row = static_cast<Eigen::Index>(6 * a), column = static_cast<Eigen::Index>(6 * b);
      out.block<6, 6>(row, column) = sum;
      out.block<6, 6>(column, row) = sum.transpose();
    }
  return out;
}

}  // namespace tutti::estimation::internal
