// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"

/// Positions on the earth (WGS 84) and the metric frames they are computed in: ECEF, whose origin is the earth's
/// centre, and ENU at a place: x east, y north, z up along the ellipsoid's normal.
namespace tutti {

struct Geodetic {
  double latitude_deg = 0.0;   ///< -90 to 90.
  double longitude_deg = 0.0;  ///< -180 to 180, east positive.
  double height_m = 0.0;       ///< Above the WGS 84 ellipsoid, which lies up to 100 m from mean sea level.
  friend bool operator==(const Geodetic&, const Geodetic&) = default;
};

/// Heights that check_geodetic() accepts: no robot is lower or higher.
inline constexpr double kLowestHeight_m = -12'000.0;
inline constexpr double kGreatestHeight_m = 100'000.0;

/// Accepts a finite position within the ranges above; ErrorCode::invalid names the value that is outside.
[[nodiscard]] Status check_geodetic(const Geodetic& position);

/// ECEF coordinates, m, of a position that check_geodetic() accepts.
[[nodiscard]] Eigen::Vector3d ecef_of(const Geodetic& position);
/// The inverse of ecef_of(), to a micrometre from 12 km below the ellipsoid to 100 km above it; at a pole the longitude
/// is 0. Source: Bowring, "Transformation from spatial to geographical coordinates", Survey Review 1976, with its step
/// repeated.
[[nodiscard]] Geodetic geodetic_of(const Eigen::Vector3d& p_ecef);
/// T_ecef_enu of the ENU frame whose origin is `origin`, m.
[[nodiscard]] Pose3 enu_in_ecef(const Geodetic& origin);

}  // namespace tutti
