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
#include "tutti/evaluation/discontinuity.hpp"
#include "tutti/model/trajectory.hpp"

/// Compares two trajectories of one body as a robot compares itself with the server's map: A takes the
/// place of the server, B that of the robot's odometry.
namespace tutti::mission {

/// One trajectory from a file or folder.
struct NamedTrajectory {
  std::string name;  ///< Name of the robot; empty when there is only one.
  Trajectory poses;
  /// Covariance of the motion from pose k to k + 1 (right tangent), positive definite; one fewer than poses, or empty
  /// when unknown.
  std::vector<Matrix6d> step_covariance;
};

/// How two trajectories are compared; A judges, B is judged.
struct CompareTrajectoriesConfig {
  evaluation::AssociationConfig association;  ///< B's poses are the estimates, A's the references.
  double tolerance_m = 0.05;                  ///< Standard deviation of A's positions, over segments of any length.
  double tolerance_deg = 0.5;                 ///< Standard deviation of A's rotations.
  /// Distance between nodes along A; they are closer where B departs from A by more than twice as much. 0: a 500th of
  /// the trajectory, at least 0.1 m.
  double spacing_m = 0.0;
  double odometry_m = 0.03;   ///< When B has no covariance: standard deviation of its motion over 1 m, which grows with
  double odometry_deg = 0.3;  ///< the square root of the distance.
  double false_alarm_rate = 0.01;
};

/// How B differs from A.
struct TrajectoryComparison {
  std::string name;
  std::size_t poses = 0;   ///< Poses of B.
  std::size_t paired = 0;  ///< Poses of B that have one of A.
  double spacing_m = 0.0;  ///< As it was used.
  double length_m = 0.0;   ///< Length along A.
  Trajectory judge;        ///< A at the nodes, in A's frame.
  Trajectory judged;       ///< B at the nodes, moved into A's frame by one rigid alignment.
  Trajectory corrected;    ///< B at the nodes after optimising it with the constraints, moved likewise.
  consistency::Explanation explanation;
  /// Relative poses of A that would correct B, chosen by the policy `adaptive`.
  std::vector<consistency::Constraint> constraints;
  evaluation::AteResult before;             ///< ATE of B's nodes against A's.
  evaluation::AteResult after;              ///< ATE of `corrected` against A's nodes.
  evaluation::Discontinuity discontinuity;  ///< How much the correction changes B's short motions.
};

/// Fails when fewer than two poses of B have one of A at their time, or a covariance is not positive definite.
Result<TrajectoryComparison> compare_trajectories(const NamedTrajectory& a, const NamedTrajectory& b,
                                                  const CompareTrajectoriesConfig& config);

}  // namespace tutti::mission
