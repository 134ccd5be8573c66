// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/alignment.hpp"

#include <Eigen/SVD>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti {
namespace {

// A line whose width is 1e-6 of its length has singular values 1e-12 apart: its roll is rounding, not data.
constexpr double kCollinear = 1e-12;
// Points closer together than 1e-10 of their distance from the origin are one point.
constexpr double kCoincident = 1e-20;

/// Rotation that maximises tr(R^T cross), cross = sum a b^T of centred points [Umeyama 1991, eq. 40]; where the points
/// leave a choice, the smallest one. `extent2` is the squared size that the points' coordinates have.
Eigen::Quaterniond best_rotation(const Eigen::Matrix3d& cross, double extent2) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& s = svd.singularValues();
  if (s(0) <= kCoincident * extent2) return Eigen::Quaterniond::Identity();
  if (s(1) <= kCollinear * s(0))  // only the line's direction is known: turn it by the smaller angle
    return rotation_between(svd.matrixV().col(0), svd.matrixU().col(0)).normalized();
  return Eigen::Quaterniond(project_to_so3(cross)).normalized();
}

Eigen::Vector3d mean(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

}  // namespace

Pose3 align_points(std::span<const Eigen::Vector3d> points_a, std::span<const Eigen::Vector3d> points_b) {
  TUTTI_CHECK(points_a.size() == points_b.size(), "{} and {} points", points_a.size(), points_b.size());
  if (points_a.empty()) return {};
  const Eigen::Vector3d mean_a = mean(points_a);
  const Eigen::Vector3d mean_b = mean(points_b);
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  double extent2 = 0.0;
  for (std::size_t i = 0; i < points_a.size(); ++i) {
    cross += (points_a[i] - mean_a) * (points_b[i] - mean_b).transpose();
    extent2 += points_a[i].norm() * points_b[i].norm();
  }
  const Eigen::Quaterniond q = best_rotation(cross, extent2);
  return {q, mean_a - q * mean_b};
}

}  // namespace tutti
