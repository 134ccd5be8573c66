// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/robot/odometry_covariance.hpp"

#include "tutti/geometry/so3.hpp"

namespace tutti::robot {
namespace {

double variance(double per_sqrt_m, double per_sqrt_deg, double per_sqrt_s, double m, double deg, double s) {
  return per_sqrt_m * per_sqrt_m * m + per_sqrt_deg * per_sqrt_deg * deg + per_sqrt_s * per_sqrt_s * s;
}

}  // namespace

std::vector<Matrix6d> increment_covariances(const Trajectory& odometry, const OdometryCovarianceConfig& config) {
  std::vector<Matrix6d> covariances;
  for (std::size_t k = 0; k + 1 < odometry.size(); ++k) {
    const Pose3 increment = odometry[k].pose.inverse() * odometry[k + 1].pose;
    const double metres = increment.translation.norm();
    const double degrees = rotation_angle(increment) / kRadPerDeg;
    const double seconds = odometry[k + 1].stamp - odometry[k].stamp;
    const double translation = variance(config.translation_m_per_sqrt_m, config.translation_m_per_sqrt_deg,
                                        config.translation_m_per_sqrt_s, metres, degrees, seconds);
    const double rotation = kRadPerDeg * kRadPerDeg *
                            variance(config.rotation_deg_per_sqrt_m, config.rotation_deg_per_sqrt_deg,
                                     config.rotation_deg_per_sqrt_s, metres, degrees, seconds);
    Vector6d diagonal;
    diagonal << Eigen::Vector3d::Constant(translation), Eigen::Vector3d::Constant(rotation);
    covariances.emplace_back(diagonal.asDiagonal());
  }
  return covariances;
}

}  // namespace tutti::robot
