// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "tutti/model/trajectory.hpp"
#include "tutti/program/feed/feed_settings.hpp"

namespace tutti::program {

/// Turns a robot's corrections into ones that it can drive by: T_map_odom follows the robot's own at a limited speed,
/// or jumps and reports it. The speed is measured at the body, because far from the origin of `odom` a small turn of
/// T_map_odom moves the body by metres.
class SmoothMap {
 public:
  SmoothMap(const FeedSettings& settings, const Pose3& T_map_odom) : settings_(settings), T_map_odom_(T_map_odom) {}

  struct Jump {
    Pose3 from, to;  ///< T_map_odom
    double translation_m = 0.0, rotation_rad = 0.0;
  };
  struct Answer {
    Pose3 T_map_odom;
    /// T_map_odom's, right tangent: the robot's own uncertainty, plus what is left to go to its own correction.
    Matrix6d covariance = Matrix6d::Zero();
    std::optional<Jump> jump;  ///< The jump that this answer makes.
  };
  /// Advances to `sample` (T_odom_body), where the robot's own T_map_odom is `target`. `covariance` is that of target *
  /// T_odom_body, right tangent.
  Answer step(const StampedPose& sample, const Pose3& target, const Matrix6d& covariance);
  /// The client's odometry began anew: from now on `odom` is another frame. The body stays where it is on the map.
  Jump change_odom(const Pose3& T_old_new);
  [[nodiscard]] const Pose3& T_map_odom() const { return T_map_odom_; }

 private:
  FeedSettings settings_;
  Pose3 T_map_odom_;
  std::optional<Timestamp> last_;
};

}  // namespace tutti::program
