// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/stretch_covariance.hpp"

#include <algorithm>
#include <bit>

#include "tutti/base/check.hpp"

namespace tutti {
namespace {

Matrix6d moved(const Pose3& T_a_b, const Matrix6d& covariance_b) {
  const Matrix6d Ad = adjoint(T_a_b);
  const Matrix6d out = Ad * covariance_b * Ad.transpose();
  return 0.5 * (out + out.transpose());
}

/// The first pose of the right half of the block of 2^(level + 1) poses that pose k is in.
std::size_t middle_of(std::size_t k, std::size_t level) { return ((k >> (level + 1)) << (level + 1)) + (1UL << level); }

}  // namespace

StretchCovariance::StretchCovariance(std::span<const Pose3> poses, std::span<const Matrix6d> steps)
    : poses_(poses.begin(), poses.end()) {
  TUTTI_CHECK(poses.size() == steps.size(), "{} poses, {} steps", poses.size(), steps.size());
  const std::size_t n = poses_.size();
  for (std::size_t level = 0; (1UL << level) < n; ++level) {
    std::vector<Matrix6d>& sums = level_.emplace_back(n, Matrix6d::Zero());
    for (std::size_t middle = 1UL << level; middle < n; middle += 2UL << level) {
      const Pose3 T_middle_w = poses_[middle].inverse();
      const std::size_t end = std::min(n, middle + (1UL << level));
      for (std::size_t k = middle + 1; k < end; ++k) sums[k] = sums[k - 1] + moved(T_middle_w * poses_[k], steps[k]);
      for (std::size_t k = middle; k-- > middle - (1UL << level);)
        sums[k] = sums[k + 1] + moved(T_middle_w * poses_[k + 1], steps[k + 1]);
    }
  }
}

Matrix6d StretchCovariance::operator()(std::size_t a, std::size_t b) const {
  TUTTI_CHECK(a <= b && b < size(), "a = {}, b = {}, {} poses", a, b, size());
  if (a == b) return Matrix6d::Zero();
  const auto level = static_cast<std::size_t>(std::bit_width(a ^ b) - 1);
  const std::size_t middle = middle_of(a, level);
  return moved(poses_[b].inverse() * poses_[middle], level_[level][a] + level_[level][b]);
}

}  // namespace tutti
