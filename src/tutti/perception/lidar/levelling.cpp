// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/levelling.hpp"

#include <cmath>

#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::lidar {
namespace {
constexpr double kSearchDeg[] = {25.0, 25.0, 12.0, 8.0, kUpToleranceDeg, kUpToleranceDeg};
constexpr double kMinShare = 0.1;  // fewer normals than this cannot overrule the prior

struct Split {
  Eigen::Matrix3d walls_minus_floors = Eigen::Matrix3d::Zero();
  double used = 0.0, all = 0.0;
};

Split split(std::span<const Eigen::Vector3f> normals, const Eigen::Vector3d& up, double tolerance_deg) {
  const double sine = std::sin(tolerance_deg * kRadPerDeg), cosine = std::cos(tolerance_deg * kRadPerDeg);
  Split out;
  for (const auto& normal : normals) {
    if (normal == Eigen::Vector3f::Zero()) continue;
    const Eigen::Vector3d n = normal.cast<double>();
    const double vertical = std::abs(n.dot(up));
    out.all += 1.0;
    if (vertical < sine)
      out.walls_minus_floors += n * n.transpose();
    else if (vertical > cosine)
      out.walls_minus_floors -= n * n.transpose();
    else
      continue;
    out.used += 1.0;
  }
  return out;
}

}  // namespace

UpDirection refine_up(std::span<const Eigen::Vector3f> normals, const Eigen::Vector3d& prior) {
  UpDirection result{.up = prior.normalized()};
  for (const double tolerance : kSearchDeg) {
    const Split sums = split(normals, result.up, tolerance);
    if (sums.used < kMinShare * sums.all || sums.used < 10.0) break;
    const Eigen3 eigen = eigen_of(sums.walls_minus_floors);
    const Eigen::Vector3d up = eigen.vectors.col(0);
    // Walls of one direction only leave up free to turn about their normal: then the smallest two eigenvalues are
    // close.
    if (eigen.values[1] - eigen.values[0] < kMinShare * sums.used) break;
    result.up = up.dot(result.up) < 0.0 ? Eigen::Vector3d(-up) : up;
  }
  const Split final_sums = split(normals, result.up, kUpToleranceDeg);
  result.support = final_sums.all > 0.0 ? final_sums.used / final_sums.all : 0.0;
  return result;
}

}  // namespace tutti::lidar
