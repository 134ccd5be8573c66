// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/posterior_samples.hpp"

#include <cblas.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <utility>
#include <vector>

#include "tutti/base/single_thread.hpp"
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

/// Columns of L^-1 at the asked variables: Y with H^-1 = Y^T Y there. Variables are eliminated from the first on, so a
/// supernode knows of those alone that come before its end, and of their rows only its ancestors' are ever filled.
class InverseColumns {
 public:
  InverseColumns(const CholeskyFactor& factor, std::vector<int> variables)
      : factor_(factor), variables_(std::move(variables)) {
    const CholeskyFactor::Layout& layout = *factor.layout;
    begin_.assign(layout.supernodes.size(), -1);
    for (const int variable : variables_) begin_[static_cast<std::size_t>(layout.supernode_of[variable])] = 0;
    Eigen::Index rows = 0;
    for (std::size_t s = 0; s < begin_.size(); ++s) {
      if (begin_[s] < 0) continue;
      begin_[s] = rows;
      rows += layout.panels[s].columns;
      if (const auto& below = layout.supernodes[s].below; !below.empty())
        begin_[static_cast<std::size_t>(layout.supernode_of[below.front()])] = 0;
    }
    Y_ = Eigen::MatrixXd::Zero(rows, 6 * std::ssize(variables_));
    for (Eigen::Index v = 0; v < std::ssize(variables_); ++v)
      Y_.block<6, 6>(row_of(variables_[static_cast<std::size_t>(v)]), 6 * v).setIdentity();
  }

  /// Y^T Y, of which only the lower triangle is meant.
  [[nodiscard]] Eigen::MatrixXd squared() && {
    const SingleThread single_thread;
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(Y_.cols(), Y_.cols());
    std::size_t known = 0;  // variables that come before the end of the supernode
    for (std::size_t s = 0; s < begin_.size(); ++s) {
      if (begin_[s] < 0) continue;
      while (known < variables_.size() && variables_[known] < factor_.layout->supernodes[s].end()) ++known;
      const int width = factor_.layout->panels[s].columns, columns = 6 * static_cast<int>(known);
      eliminate(s, columns);
      cblas_dsyrk(CblasColMajor, CblasLower, CblasTrans, columns, width, 1.0, &Y_(begin_[s], 0),
                  static_cast<int>(Y_.rows()), 1.0, out.data(), static_cast<int>(out.rows()));
    }
    return out;
  }

 private:
  [[nodiscard]] Eigen::Index row_of(int variable) const {
    const auto s = static_cast<std::size_t>(factor_.layout->supernode_of[variable]);
    return begin_[s] + 6 * (variable - factor_.layout->supernodes[s].first);
  }

  /// Y_J <- L_JJ^-1 Y_J, and Y_I <- Y_I - L_IJ Y_J below.
  void eliminate(std::size_t s, int columns) {
    const CholeskyFactor::Panel& panel = factor_.layout->panels[s];
    const auto Y_J = Y_.block(begin_[s], 0, panel.columns, columns);
    factor_.solve_within(s, false, Y_J);
    if (panel.below() == 0) return;
    const Eigen::MatrixXd product = factor_.times_below(s, Y_J);
    Eigen::Index k = 0;
    for (const int row : factor_.layout->supernodes[s].below)
      Y_.block(row_of(row), 0, 6, columns) -= product.middleRows(6 * k++, 6);
  }

  const CholeskyFactor& factor_;
  std::vector<int> variables_;       // increasing
  std::vector<Eigen::Index> begin_;  // per supernode its first row of Y, or -1: none of the variables depends on it
  Eigen::MatrixXd Y_;
};

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
  std::vector<int> asked;
  for (const int variable : variables)
    if (variable >= 0) asked.push_back(variable);
  std::ranges::sort(asked);
  const auto twice = std::ranges::unique(asked);
  asked.erase(twice.begin(), twice.end());
  const auto size = 6 * std::ssize(variables);
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(size, size);
  if (asked.empty()) return out;
  Eigen::MatrixXd squared = InverseColumns(factor, asked).squared();
  squared.triangularView<Eigen::StrictlyUpper>() = squared.transpose();
  const auto at = [&](int variable) { return 6 * (std::ranges::lower_bound(asked, variable) - asked.begin()); };
  for (std::size_t a = 0; a < variables.size(); ++a)
    for (std::size_t b = 0; b < variables.size(); ++b)
      if (variables[a] >= 0 && variables[b] >= 0)
        out.block<6, 6>(static_cast<Eigen::Index>(6 * a), static_cast<Eigen::Index>(6 * b)) =
            squared.block<6, 6>(at(variables[a]), at(variables[b]));
  return out;
}

}  // namespace tutti::estimation::internal
