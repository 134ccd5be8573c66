// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/rays.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace tutti {

std::optional<Eigen::Vector3d> nearest_point(std::span<const Ray> rays) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const Ray& ray : rays) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    A += across;
    b += across * ray.origin;
  }
  const Eigen::LLT<Eigen::Matrix3d> llt(A);
  if (llt.info() != Eigen::Success) return std::nullopt;
  return llt.solve(b);
}

double largest_angle(std::span<const Ray> rays) {
  double least_cosine = 1.0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) least_cosine = std::min(least_cosine, rays[i].direction.dot(rays[j].direction));
  return std::acos(std::clamp(least_cosine, -1.0, 1.0));
}

}  // namespace tutti
