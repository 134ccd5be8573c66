// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/input.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/robot/odometry_watch.hpp"

namespace tutti::program {

/// Where a robot is while its agent is samples behind: the pose and its uncertainty at the agent's newest sample,
/// carried on by the odometry since. Takes samples that passed an OdometryGate, and detects jumps of odometry, exactly
/// as RobotAgent::add() does.
class CarriedPose {
 public:
  /// When the agent is further behind, the oldest steps are compounded to one.
  static constexpr std::size_t kMostSteps = 1024;

  explicit CarriedPose(RobotId robot) : robot_(robot) {}

  /// Adds a sample; returns whether odometry has jumped at it. An error states why the sample was refused; nothing has
  /// changed then.
  Result<bool> add(const OdometrySample& sample);
  /// Takes over what the agent knows at its newest sample: the samples up to it, and the covariance there.
  void correct(const robot::OdometryWatch& watch, const Matrix6d& covariance);

  /// T_odom_body in the client's frame, as it was fed.
  [[nodiscard]] const std::optional<StampedPose>& newest() const { return watch_.state().newest; }
  [[nodiscard]] const robot::OdometryWatch& watch() const { return watch_; }
  [[nodiscard]] const Matrix6d& covariance() const { return covariance_; }  ///< T_map_body's, right tangent.
  /// Number of samples since the agent's newest; at most kMostSteps.
  [[nodiscard]] std::size_t steps() const { return steps_.size(); }

 private:
  struct Step {
    Timestamp end;
    RelativePose motion;
  };
  void carry(const RelativePose& motion);

  RobotId robot_;
  robot::OdometryWatch watch_;
  Matrix6d covariance_ = Matrix6d::Zero();
  std::deque<Step> steps_;  // since the agent's sample
};

}  // namespace tutti::program
