// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/consistency/constraint.hpp"
#include "tutti/consistency/explanation.hpp"
#include "tutti/evaluation/association.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/kink.hpp"
#include "tutti/model/trajectory.hpp"

/// Two trajectories of one body, explained as a robot explains itself against the server's map: A plays the server, B
/// the robot's odometry.
namespace tutti::mission {

/// One trajectory of a file or folder.
struct NamedTrajectory {
  std::string name;  ///< Of the robot; empty when there is only one.
  Trajectory poses;
  /// Of the motion from pose k to k + 1 (right tangent), positive definite; one fewer than poses, or empty: not known.
  std::vector<Matrix6d> step_covariance;
};

struct CompareTrajectoriesConfig {
  evaluation::AssociationConfig association;  ///< B's poses are the estimates, A's the references.
  double tolerance_m = 0.05;                  ///< Standard deviation of A's positions, over stretches of any length.
  double tolerance_deg = 0.5;                 ///< The same of its rotations.
  /// Nodes are this far apart along A, nearer where B parts from A by twice as much; 0: a 500th of the way, at least
  /// 0.1 m.
  double spacing_m = 0.0;
  double odometry_m = 0.03;   ///< Where B brings no covariance: standard deviation of its motion over 1 m; grows with
  double odometry_deg = 0.3;  ///< the square root of the way.
  double false_alarm_rate = 0.01;
};

struct TrajectoryComparison {
  std::string name;
  std::size_t poses = 0;   ///< Of B.
  std::size_t paired = 0;  ///< Of these, with a pose of A.
  double spacing_m = 0.0;  ///< As used.
  double way_m = 0.0;      ///< Along A.
  Trajectory judge;        ///< A at the nodes, in A's frame.
  Trajectory judged;       ///< B at the nodes, moved into A's frame by one rigid alignment.
  Trajectory corrected;    ///< B with the constraints at the nodes, likewise.
  consistency::Explanation explanation;
  std::vector<consistency::Constraint> constraints;  ///< Relative poses of A that would fix B; the policy `adaptive`'s.
  evaluation::AteResult before;                      ///< B's nodes against A's.
  evaluation::AteResult after;                       ///< `corrected` against A's.
  evaluation::Kink kink;                             ///< What correcting does to B's short motions.
};

/// Fails when fewer than two poses of B have one of A at their time, or a covariance is not positive definite.
Result<TrajectoryComparison> compare_trajectories(const NamedTrajectory& a, const NamedTrajectory& b,
                                                  const CompareTrajectoriesConfig& config);

}  // namespace tutti::mission
