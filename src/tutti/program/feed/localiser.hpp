// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <deque>
#include <optional>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/node/journal.hpp"

namespace tutti::program {

/// Where a robot is in its odometry, and how sure it is of that on its map, while its agent is samples behind: what the
/// agent said at its own newest sample, carried on by odometry. Takes and refuses samples as
/// RobotAgent::add_odometry() does.
class Localiser {
 public:
  static constexpr std::size_t kMostSteps = 1024;  ///< Behind by more, the oldest are one step.

  explicit Localiser(RobotId robot) : robot_(robot) {}

  /// An error: it is refused, and why; nothing has changed.
  Status add(const node::OdometrySample& sample);
  /// The agent was here, this sure.
  void correct(const StampedPose& at, const Matrix6d& covariance);

  [[nodiscard]] const std::optional<StampedPose>& newest() const { return newest_; }  ///< T_odom_body
  [[nodiscard]] const Matrix6d& covariance() const { return covariance_; }            ///< Of T_map_body, right tangent.
  /// Samples that the agent has not said anything about yet; at most kMostSteps.
  [[nodiscard]] std::size_t steps() const { return steps_.size(); }

 private:
  struct Step {
    Timestamp end;
    RelativePose motion;
  };
  void carry(const RelativePose& motion);

  RobotId robot_;
  std::optional<StampedPose> newest_;
  Matrix6d covariance_ = Matrix6d::Zero();
  std::deque<Step> steps_;  // since the agent's sample
};

}  // namespace tutti::program
