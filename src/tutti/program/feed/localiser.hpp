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
#include "tutti/robot/odometry_watch.hpp"

namespace tutti::program {

/// Where a robot is in its odometry, and how sure it is of that on its map, while its agent is samples behind: what the
/// agent said at its own newest sample, carried on by odometry. Takes and refuses samples, and sees them jump, as
/// RobotAgent::add_odometry() does.
class Localiser {
 public:
  static constexpr std::size_t kMostSteps = 1024;  ///< Behind by more, the oldest are one step.

  explicit Localiser(RobotId robot) : robot_(robot) {}

  /// An error: it is refused, and why; nothing has changed. Otherwise whether odometry has jumped there.
  Result<bool> add(const node::OdometrySample& sample);
  /// The agent has heard these samples, and is this sure.
  void correct(const robot::OdometryWatch& watch, const Matrix6d& covariance);

  /// As fed.
  [[nodiscard]] const std::optional<StampedPose>& newest() const { return watch_.state().newest; }
  [[nodiscard]] const robot::OdometryWatch& watch() const { return watch_; }
  [[nodiscard]] const Matrix6d& covariance() const { return covariance_; }  ///< Of T_map_body, right tangent.
  /// Samples that the agent has not said anything about yet; at most kMostSteps.
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
