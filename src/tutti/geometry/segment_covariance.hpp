// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"

namespace tutti {

/// Covariance of the relative pose between any two poses of a chain whose steps are independent. Every query adds sums
/// of the steps' covariances in the frame of the first pose, and never subtracts one, so the result is positive
/// definite when the steps' are, however long the chain and however unequal its steps. n poses take 3.2 n matrices and
/// time in proportion; a query adds at most 16 matrices, and two for every factor of 16 between its poses: sums within
/// blocks of 16 poses, within blocks of 16 such blocks, and so on.
class SegmentCovariance {
 public:
  SegmentCovariance() = default;
  /// `poses`: T_w_k in any one frame w, k = 0 .. n - 1. `steps[k]`: covariance of T_{k-1}^-1 T_k (right tangent);
  /// steps[0] is not used, but both spans have one size (checked).
  SegmentCovariance(std::span<const Pose3> poses, std::span<const Matrix6d> steps);

  [[nodiscard]] std::size_t size() const { return poses_.size(); }
  /// Covariance of T_a_b = T_w_a^-1 T_w_b (right tangent, first order), a <= b < size(); zero for a == b.
  [[nodiscard]] Matrix6d operator()(std::size_t a, std::size_t b) const;
  [[nodiscard]] std::size_t bytes() const;  ///< Its size on the heap.

 private:
  /// Places, of which every 16th is one of the next level. `step`: from the place before, `upto`: from the begin of the
  /// place's block, `after`: to the begin of the next block (or to the end).
  struct Level {
    explicit Level(std::vector<Matrix6d> steps);
    std::vector<Matrix6d> step, upto, after;
  };
  std::vector<Pose3> poses_;  ///< T_first_k
  std::vector<Level> levels_;
};

}  // namespace tutti
