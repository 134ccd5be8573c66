// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <string>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

namespace tutti {

/// Ranges beyond these limits are refused as an error of the sender: no radio reaches as far, nor is as good or as bad.
inline constexpr double kFarthestRange_m = 1e5, kLeastRangeSigma_m = 1e-3, kLargestRangeSigma_m = 100.0;
/// The standard deviation of a range whose radio does not state one: what makers of UWB radios promise in sight.
inline constexpr double kUnknownRange_m = 0.1;

/// A range to another robot: the distance between the antenna of this robot's radio and that of the other one's, by the
/// clock that all robots share.
struct RobotRange {
  Timestamp stamp;
  RobotId to;
  double distance_m = 0.0;
  double sigma_m = 0.0;                                      ///< Standard deviation; 0: not stated.
  Eigen::Vector3d p_body_antenna = Eigen::Vector3d::Zero();  ///< This robot's antenna, m.
  /// The other robot's name; empty where `to` is its number already. It is neither sent nor stored: who knows the
  /// mission's names sets `to` by it.
  std::string name;
  using InColumns = void;
  template <class V>
  void describe(V& v) {
    v.field(1, "stamp", stamp);
    v.field(2, "to", to);
    v.field(3, "distance_m", distance_m);
    v.field(4, "sigma_m", sigma_m);
    v.field(5, "antenna_x_m", p_body_antenna.x());
    v.field(6, "antenna_y_m", p_body_antenna.y());
    v.field(7, "antenna_z_m", p_body_antenna.z());
  }
  friend bool operator==(const RobotRange&, const RobotRange&) = default;
};

/// Fails unless the distance is a number from 0 to kFarthestRange_m, the standard deviation one within the limits above
/// or 0, the antenna within kFarthestAntenna_m of the body, and the name, if there is one, a robot's.
[[nodiscard]] Status check_range(const RobotRange& range);

}  // namespace tutti
