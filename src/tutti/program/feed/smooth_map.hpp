// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>

#include "tutti/model/trajectory.hpp"
#include "tutti/program/feed/feed_settings.hpp"

namespace tutti::program {

/// Corrections as a robot can drive by: T_map_odom follows the robot's own bit by bit, or jumps and says so. How far it
/// moves is measured where the body is: far from where `odom` begins, a small turn of T_map_odom moves it by metres.
class SmoothMap {
 public:
  SmoothMap(const FeedSettings& settings, const Pose3& T_map_odom) : settings_(settings), T_map_odom_(T_map_odom) {}

  struct Jump {
    Pose3 from, to;  ///< T_map_odom
    double translation_m = 0.0, rotation_rad = 0.0;
  };
  struct Answer {
    Pose3 T_map_odom;
    /// Right tangent. Of the robot's own, and what is left to go to it.
    Matrix6d covariance = Matrix6d::Zero();
    std::optional<Jump> jump;  ///< What this answer has done.
  };
  /// At a sample T_odom_body, where the robot's own T_map_odom is `target`; `covariance`: of target * T_odom_body,
  /// right tangent.
  Answer step(const StampedPose& sample, const Pose3& target, const Matrix6d& covariance);
  /// `odom` is another frame from now on: its front end began anew. The body stays where it is on the map.
  Jump change_odom(const Pose3& T_old_new);
  [[nodiscard]] const Pose3& T_map_odom() const { return T_map_odom_; }

 private:
  FeedSettings settings_;
  Pose3 T_map_odom_;
  std::optional<Timestamp> last_;
};

}  // namespace tutti::program
