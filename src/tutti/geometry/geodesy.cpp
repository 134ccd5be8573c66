// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/geodesy.hpp"

#include <cmath>

#include "tutti/geometry/so3.hpp"

namespace tutti {
namespace {

// WGS 84 (NGA.STND.0036): semi-major axis and flattening define all others.
constexpr double kA_m = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kB_m = kA_m * (1.0 - kFlattening);
constexpr double kE2 = kFlattening * (2.0 - kFlattening);  // first eccentricity, squared
constexpr double kSecondE2 = (kA_m * kA_m - kB_m * kB_m) / (kB_m * kB_m);
constexpr int kBowringSteps = 3;

}  // namespace

Status check_geodetic(const Geodetic& position) {
  if (!(std::abs(position.latitude_deg) <= 90.0))
    return fail(ErrorCode::invalid, "latitude {} degrees, expected -90 to 90", position.latitude_deg);
  if (!(std::abs(position.longitude_deg) <= 180.0))
    return fail(ErrorCode::invalid, "longitude {} degrees, expected -180 to 180", position.longitude_deg);
  if (!(position.height_m >= kLowestHeight_m && position.height_m <= kGreatestHeight_m))
    return fail(ErrorCode::invalid, "height {} m, expected {} to {} m", position.height_m, kLowestHeight_m,
                kGreatestHeight_m);
  return {};
}

Eigen::Vector3d ecef_of(const Geodetic& position) {
  const double latitude = position.latitude_deg * kRadPerDeg, longitude = position.longitude_deg * kRadPerDeg;
  const double s = std::sin(latitude), c = std::cos(latitude);
  const double normal_m = kA_m / std::sqrt(1.0 - kE2 * s * s);  // prime vertical radius of curvature
  return {(normal_m + position.height_m) * c * std::cos(longitude),
          (normal_m + position.height_m) * c * std::sin(longitude), (normal_m * (1.0 - kE2) + position.height_m) * s};
}

Geodetic geodetic_of(const Eigen::Vector3d& p) {
  const double from_axis_m = std::hypot(p.x(), p.y());
  double reduced = std::atan2(kA_m * p.z(), kB_m * from_axis_m), latitude = 0.0;
  for (int k = 0; k < kBowringSteps; ++k) {
    const double s = std::sin(reduced), c = std::cos(reduced);
    latitude = std::atan2(p.z() + kSecondE2 * kB_m * s * s * s, from_axis_m - kE2 * kA_m * c * c * c);
    reduced = std::atan2(kB_m * std::sin(latitude), kA_m * std::cos(latitude));
  }
  const double s = std::sin(latitude), c = std::cos(latitude);
  return {latitude / kRadPerDeg, from_axis_m > 0.0 ? std::atan2(p.y(), p.x()) / kRadPerDeg : 0.0,
          from_axis_m * c + p.z() * s - kA_m * std::sqrt(1.0 - kE2 * s * s)};
}

Pose3 enu_in_ecef(const Geodetic& origin) {
  const double latitude = origin.latitude_deg * kRadPerDeg, longitude = origin.longitude_deg * kRadPerDeg;
  const double s = std::sin(latitude), c = std::cos(latitude);
  Eigen::Matrix3d R;
  R.col(0) << -std::sin(longitude), std::cos(longitude), 0.0;
  R.col(2) << c * std::cos(longitude), c * std::sin(longitude), s;
  R.col(1) = R.col(2).cross(R.col(0));
  return {Eigen::Quaterniond(R).normalized(), ecef_of(origin)};
}

}  // namespace tutti
