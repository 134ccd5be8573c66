// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/selected_inverse.hpp"

#include <cblas.h>
#include <lapacke.h>

#include <algorithm>

#include "tutti/base/check.hpp"
#include "tutti/base/single_thread.hpp"

namespace tutti::estimation::internal {
namespace {

Eigen::Map<Eigen::MatrixXd> workspace(std::vector<double>& buffer, int rows, int columns) {
  const auto size = static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
  if (buffer.size() < size) buffer.resize(size);
  return {buffer.data(), rows, columns};
}

}  // namespace

SelectedInverse::SelectedInverse(const BlockCholesky::Columns& factor) {
  const int n = static_cast<int>(factor.start.size()) - 1;
  const auto count = [&](int j) { return factor.start[j + 1] - factor.start[j]; };
  // Column j + 1 continues a panel when it is j's parent with one row less: its structure contains j's.
  const auto continues = [&](int j) {
    return count(j) == count(j + 1) + 1 && factor.row[factor.start[j] + 1] == j + 1;
  };
  panel_of_column_.resize(n);
  for (int j = 0; j < n;) {
    int end = j + 1;
    while (end < n && count(end - 1) > 1 && continues(end - 1)) ++end;
    Panel panel{.first = j, .columns = end - j};
    panel.rows.assign(factor.row.begin() + factor.start[j], factor.row.begin() + factor.start[j + 1]);
    panel.values.setZero(count(j), end - j);
    for (int k = j; k < end; ++k) {
      panel_of_column_[k] = static_cast<int>(panels_.size());
      std::copy(factor.value.begin() + factor.start[k], factor.value.begin() + factor.start[k + 1],
                panel.values.col(k - j).data() + (k - j));
    }
    panels_.push_back(std::move(panel));
    j = end;
  }
  const SingleThread single_thread;
  for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) invert(*panel);
}

/// With BLAS: Eigen's products of this size take several times as long where it is compiled for any
/// machine.
void SelectedInverse::invert(Panel& panel) {
  const int w = panel.columns;
  const int height = static_cast<int>(panel.rows.size()), m = height - w;
  const double* const L = panel.values.data();  // L_JJ, and L_IJ below
  Eigen::MatrixXd Z_JJ = panel.values.topRows(w);
  LAPACKE_dpotri_work(LAPACK_COL_MAJOR, 'L', w, Z_JJ.data(), w);  // (L_JJ L_JJ^T)^-1, of which the lower half
  if (m > 0) {
    Eigen::Map<Eigen::MatrixXd> Y = workspace(scaled_, m, w);
    Y = panel.values.bottomRows(m);
    cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasNoTrans, CblasNonUnit, m, w, 1.0, L, height, Y.data(), m);
    const double* const Z_II = gather_below(panel).data();
    double* const Z_IJ = panel.values.data() + w;
    cblas_dsymm(CblasColMajor, CblasLeft, CblasLower, m, w, -1.0, Z_II, m, Y.data(), m, 0.0, Z_IJ, height);
    cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, w, w, m, -1.0, Y.data(), m, Z_IJ, height, 1.0, Z_JJ.data(), w);
  }
  panel.values.topRows(w) = Z_JJ.selfadjointView<Eigen::Lower>();
}

/// The lower half of Z_II. All its entries lie in the pattern of L (the rows of a column are a clique after filling).
Eigen::Map<Eigen::MatrixXd> SelectedInverse::gather_below(const Panel& panel) {
  const auto begin = panel.rows.begin() + panel.columns;
  const int m = static_cast<int>(panel.rows.end() - begin);
  Eigen::Map<Eigen::MatrixXd> Z = workspace(gathered_, m, m);
  std::vector<int> index(m);
  for (int c = 0; c < m;) {
    const Panel& source = panels_[panel_of_column_[begin[c]]];
    auto position = source.rows.begin();
    for (int r = c; r < m; ++r) {  // both lists increase
      while (*position != begin[r]) ++position;
      index[r] = static_cast<int>(position - source.rows.begin());
    }
    const int group = c;
    for (; c < m && begin[c] < source.first + source.columns; ++c) {
      const double* column = source.values.col(begin[c] - source.first).data();
      double* target = Z.col(c).data();
      for (int r = std::max(c, group); r < m; ++r) target[r] = column[index[r]];
    }
  }
  return Z;
}

Matrix6d SelectedInverse::block(int row_variable, int column_variable) const {
  if (row_variable < column_variable) return block(column_variable, row_variable).transpose();
  // Panels hold whole blocks: the columns of a block have the same structure.
  const Panel& panel = panels_[panel_of_column_[6 * column_variable]];
  const auto found = std::lower_bound(panel.rows.begin(), panel.rows.end(), 6 * row_variable);
  TUTTI_CHECK(found != panel.rows.end() && *found == 6 * row_variable, "block {}, {} is not in the pattern",
              row_variable, column_variable);
  return panel.values.block<6, 6>(found - panel.rows.begin(), 6 * column_variable - panel.first);
}

// delta_a_b = delta_b - Ad(T_a_b^-1) delta_a; anchored poses do not move.
Matrix6d SelectedInverse::relative(int a, int b, const Pose3& T_b_a) const {
  const Matrix6d A = adjoint(T_b_a);
  Matrix6d covariance = Matrix6d::Zero();
  if (b >= 0) covariance += block(b, b);
  if (a >= 0) covariance += A * block(a, a) * A.transpose();
  if (a >= 0 && b >= 0) {
    const Matrix6d cross = A * block(a, b);
    covariance -= cross + cross.transpose();
  }
  return 0.5 * (covariance + covariance.transpose());
}

}  // namespace tutti::estimation::internal
