// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Covariance of the relative pose between any two poses of a chain whose steps are independent. Every query adds two
/// sums of covariances, never subtracts one, so the result is positive definite when the steps' are, however long the
/// chain and however unequal its steps. O(n log n) memory (36 doubles each) and time to make, O(1) a query: a disjoint
/// sparse table (sums to the left and to the right of the middle of every block of 2, 4, 8, ... poses).
class StretchCovariance {
 public:
  StretchCovariance() = default;
  /// `poses`: T_w_k in any one frame w, k = 0 .. n - 1. `steps[k]`: covariance of T_{k-1}^-1 T_k (right tangent);
  /// steps[0] is not used, but both spans have one size (checked).
  StretchCovariance(std::span<const Pose3> poses, std::span<const Matrix6d> steps);

  [[nodiscard]] std::size_t size() const { return poses_.size(); }
  /// Covariance of T_a_b = T_w_a^-1 T_w_b (right tangent, first order), a <= b < size(); zero for a == b.
  [[nodiscard]] Matrix6d operator()(std::size_t a, std::size_t b) const;

 private:
  std::vector<Pose3> poses_;
  /// level_[l][k]: covariance of the steps between pose k and the middle of its block of 2^(l + 1) poses, in the
  /// middle's frame.
  std::vector<std::vector<Matrix6d>> level_;
};

}  // namespace tutti
