// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/alignment.hpp"

#include <Eigen/SVD>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti {

Pose3 align_points(std::span<const Eigen::Vector3d> points_a, std::span<const Eigen::Vector3d> points_b) {
  TUTTI_CHECK(points_a.size() == points_b.size(), "{} and {} points", points_a.size(), points_b.size());
  if (points_a.empty()) return {};
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    mean_a += points_a[i];
    mean_b += points_b[i];
  }
  mean_a /= static_cast<double>(points_a.size());
  mean_b /= static_cast<double>(points_b.size());
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < points_a.size(); ++i)
    cross += (points_a[i] - mean_a) * (points_b[i] - mean_b).transpose();
  const Eigen::Quaterniond q(project_to_so3(cross));
  return {q.normalized(), mean_a - q.normalized() * mean_b};
}

}  // namespace tutti
