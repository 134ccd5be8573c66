// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::robot {

/// How much to trust real odometry that comes without covariance. Variances add up along the trajectory, so dividing a
/// step in two changes nothing.
struct OdometryCovarianceConfig {
  double translation_m_per_sqrt_m = 0.02;
  double translation_m_per_sqrt_deg = 0.001;
  double translation_m_per_sqrt_s = 0.003;
  double rotation_deg_per_sqrt_m = 0.1;
  double rotation_deg_per_sqrt_deg = 0.02;
  double rotation_deg_per_sqrt_s = 0.02;
  template <class V>
  void describe(V& v) {
    v.field("translation_m_per_sqrt_m", translation_m_per_sqrt_m, at_least(0.0), "Position, per metre travelled.");
    v.field("translation_m_per_sqrt_deg", translation_m_per_sqrt_deg, at_least(0.0), "Position, per degree turned.");
    v.field("translation_m_per_sqrt_s", translation_m_per_sqrt_s, greater_than(0.0), "Position, per second.");
    v.field("rotation_deg_per_sqrt_m", rotation_deg_per_sqrt_m, at_least(0.0), "Rotation, per metre travelled.");
    v.field("rotation_deg_per_sqrt_deg", rotation_deg_per_sqrt_deg, at_least(0.0), "Rotation, per degree turned.");
    v.field("rotation_deg_per_sqrt_s", rotation_deg_per_sqrt_s, greater_than(0.0), "Rotation, per second.");
  }
};

/// Covariance of each step k -> k + 1 (right tangent, diagonal); one fewer than poses.
std::vector<Matrix6d> increment_covariances(const Trajectory& odometry, const OdometryCovarianceConfig& config);

}  // namespace tutti::robot
