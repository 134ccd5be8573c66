// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/selected_inverse.hpp"

#include <cblas.h>
#include <lapacke.h>

#include <algorithm>
#include <utility>

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

SelectedInverse::SelectedInverse(CholeskyFactor factor) : inverse_(std::move(factor)) {
  TUTTI_CHECK(inverse_ && inverse_.layout->block_size == 6, "no factor of blocks of 6");
  const SingleThread single_thread;
  for (std::size_t s = inverse_.layout->supernodes.size(); s-- > 0;) invert(s);
}

/// With BLAS: Eigen's products of this size take several times as long where it is compiled for any
/// machine.
void SelectedInverse::invert(std::size_t supernode) {
  const auto [begin, height, w] = inverse_.layout->panels[supernode];
  const int m = height - w;
  double* const L = inverse_.panel(supernode);  // L_JJ, and L_IJ below
  Eigen::Map<Eigen::MatrixXd> panel(L, height, w);
  Eigen::MatrixXd Z_JJ = panel.topRows(w);
  LAPACKE_dpotri_work(LAPACK_COL_MAJOR, 'L', w, Z_JJ.data(), w);  // (L_JJ L_JJ^T)^-1, of which the lower half
  if (m > 0) {
    Eigen::Map<Eigen::MatrixXd> Y = workspace(scaled_, m, w);
    Y = panel.bottomRows(m);
    cblas_dtrsm(CblasColMajor, CblasRight, CblasLower, CblasNoTrans, CblasNonUnit, m, w, 1.0, L, height, Y.data(), m);
    const double* const Z_II = gather_below(inverse_.layout->supernodes[supernode]).data();
    double* const Z_IJ = L + w;
    cblas_dsymm(CblasColMajor, CblasLeft, CblasLower, m, w, -1.0, Z_II, m, Y.data(), m, 0.0, Z_IJ, height);
    cblas_dgemm(CblasColMajor, CblasTrans, CblasNoTrans, w, w, m, -1.0, Y.data(), m, Z_IJ, height, 1.0, Z_JJ.data(), w);
  }
  panel.topRows(w) = Z_JJ.selfadjointView<Eigen::Lower>();
}

/// The lower half of Z_II. All its entries lie in the pattern of L (the rows of a column are a clique after filling).
Eigen::Map<Eigen::MatrixXd> SelectedInverse::gather_below(const Supernode& node) {
  const auto m = 6 * static_cast<std::ptrdiff_t>(node.below.size());
  Eigen::Map<Eigen::MatrixXd> Z = workspace(gathered_, static_cast<int>(m), static_cast<int>(m));
  for (const Supernode::Ancestor& ancestor : node.ancestors) {
    const int height = inverse_.layout->panels[static_cast<std::size_t>(ancestor.supernode)].rows;
    const double* const from = inverse_.panel(static_cast<std::size_t>(ancestor.supernode));
    for (std::size_t k = ancestor.begin; k < ancestor.end; ++k)
      for (int c = 0; c < 6; ++c) {
        const double* const column =
            from + (6 * static_cast<std::ptrdiff_t>(ancestor.at[k - ancestor.begin]) + c) * height;
        double* const to = Z.data() + (6 * static_cast<std::ptrdiff_t>(k) + c) * m;
        for (std::size_t r = k; r < node.below.size(); ++r)
          std::copy_n(column + 6 * static_cast<std::ptrdiff_t>(ancestor.at[r - ancestor.begin]), 6,
                      to + 6 * static_cast<std::ptrdiff_t>(r));
      }
  }
  return Z;
}

Matrix6d SelectedInverse::block(int row_variable, int column_variable) const {
  if (row_variable < column_variable) return block(column_variable, row_variable).transpose();
  const auto s = static_cast<std::size_t>(inverse_.layout->supernode_of[static_cast<std::size_t>(column_variable)]);
  const Supernode& node = inverse_.layout->supernodes[s];
  const int position = node.position_of(row_variable);
  TUTTI_CHECK(position < node.rows() && node.row_at(position) == row_variable, "block {}, {} is not in the pattern",
              row_variable, column_variable);
  return inverse_.block(s, position, column_variable - node.first);
}

Eigen::Matrix<double, 12, 12> SelectedInverse::ends(const EdgeSlot& edge) const {
  Eigen::Matrix<double, 12, 12> out = Eigen::Matrix<double, 12, 12>::Zero();
  if (edge.from >= 0) out.topLeftCorner<6, 6>() = block(edge.from, edge.from);
  if (edge.to >= 0) out.bottomRightCorner<6, 6>() = block(edge.to, edge.to);
  if (edge.from >= 0 && edge.to >= 0) {
    out.topRightCorner<6, 6>() = block(edge.from, edge.to);
    out.bottomLeftCorner<6, 6>() = out.topRightCorner<6, 6>().transpose();
  }
  return out;
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
