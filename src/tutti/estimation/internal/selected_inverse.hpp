// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <vector>

#include "tutti/estimation/internal/block_structure.hpp"
#include "tutti/estimation/internal/cholesky_factor.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::estimation::internal {

/// Entries of (L L^T)^-1 on the pattern of L (Takahashi, Fagan, Chin 1973), by supernodes in the place of the factor,
/// last one first: with J a panel's columns, I its rows below, Y = L_IJ L_JJ^-1,
///   Z_IJ = -Z_II Y,   Z_JJ = (L_JJ L_JJ^T)^-1 - Y^T Z_IJ.
class SelectedInverse {
 public:
  /// A factor of 6 x 6 blocks.
  explicit SelectedInverse(CholeskyFactor factor);
  /// 6 x 6 block of two block variables; it must be in the pattern of L.
  [[nodiscard]] Matrix6d block(int row_variable, int column_variable) const;
  /// (L L^T)^-1 at the ends of an edge, `from` first; anchored ends do not move.
  [[nodiscard]] Eigen::Matrix<double, 12, 12> ends(const EdgeSlot& edge) const;
  /// Covariance of T_a_b, right tangent, of two poses whose block variables are `a` and `b`; -1: that pose is anchored.
  [[nodiscard]] Matrix6d relative(int a, int b, const Pose3& T_b_a) const;

 private:
  void invert(std::size_t supernode);
  [[nodiscard]] Eigen::Map<Eigen::MatrixXd> gather_below(const Supernode& node);

  CholeskyFactor inverse_;        ///< First L, then Z (Z_JJ complete).
  std::vector<double> gathered_;  ///< Workspace, so that large panels do not map fresh memory each.
  std::vector<double> scaled_;    ///< Y
};

}  // namespace tutti::estimation::internal
