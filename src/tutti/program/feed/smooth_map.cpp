// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/smooth_map.hpp"

#include <algorithm>
#include <utility>

#include "tutti/geometry/so3.hpp"

namespace tutti::program {

SmoothMap::Answer SmoothMap::step(const StampedPose& sample, const Pose3& target, const Matrix6d& covariance) {
  const double dt_s = last_ ? std::max(0.0, sample.stamp - *last_) : 0.0;  // odometry's clock may begin anew
  last_ = sample.stamp;
  Answer out;
  const Pose3 body = T_map_odom_ * sample.pose, wanted = target * sample.pose;
  Vector6d left = local(body, wanted);
  const double metres = left.head<3>().norm(), radians = left.tail<3>().norm();
  if (metres > settings_.jump_m || radians > settings_.jump_deg * kRadPerDeg) {
    out.jump = Jump{T_map_odom_, target, metres, radians};
    T_map_odom_ = target;
    left.setZero();
  } else {
    const double most_m = settings_.blend_m_per_s * dt_s, most_rad = settings_.blend_deg_per_s * kRadPerDeg * dt_s;
    if (metres <= most_m && radians <= most_rad) {
      T_map_odom_ = target;
      left.setZero();
    } else {
      const double share =
          std::min(metres > most_m ? most_m / metres : 1.0, radians > most_rad ? most_rad / radians : 1.0);
      const Pose3 moved = retract(body, share * left);
      T_map_odom_ = moved * sample.pose.inverse();
      left = local(moved, wanted);
    }
  }
  // T_map_odom Exp(xi_odom) T_odom_body = T_map_body Exp(xi_body), with xi_odom = Ad(T_odom_body) xi_body.
  const Matrix6d ad = adjoint(sample.pose);
  const Matrix6d of_odom = ad * (covariance + left * left.transpose()) * ad.transpose();
  out.covariance = 0.5 * (of_odom + of_odom.transpose());
  out.T_map_odom = T_map_odom_;
  return out;
}

SmoothMap::Jump SmoothMap::change_odom(const Pose3& T_old_new) {
  const Pose3 before = std::exchange(T_map_odom_, T_map_odom_ * T_old_new);
  return {before, T_map_odom_};
}

}  // namespace tutti::program
