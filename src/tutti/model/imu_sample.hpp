// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include "tutti/base/timestamp.hpp"

namespace tutti {

/// What an inertial sensor at the body frame measures, in that frame.
struct ImuSample {
  Timestamp stamp;
  Eigen::Vector3d gyroscope;      ///< Angular rate, rad/s.
  Eigen::Vector3d accelerometer;  ///< Specific force, m/s^2: about +9.8 along z when level and at rest.
  friend bool operator==(const ImuSample&, const ImuSample&) = default;
};

}  // namespace tutti
