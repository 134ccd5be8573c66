// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "tutti/geometry/pose3.hpp"

namespace tutti::consistency {

/// A function on the synchronised nodes that is compared between server and robot, each filtered on its own graph:
/// poses in time order, n of them -> n x d, metres. Unchanged when all poses are moved by one rigid transform: the two
/// graphs live in unrelated frames. docs/math.md says what each signal can and cannot see. `name` (checked) is
///   "distance": the paper's, ||x_n - x_0||. Blind to any turn about node 0, and nearly so to what lies across the line
///     of sight from node 0;
///   "pose": where node n is, seen from node 0. Sees where drift has carried a robot more than where it was born;
///   "relative_motion": where node n is, seen from node n - 1; nothing at the first node. Needs no gauge at all; sees
///     every bend where it happens and nowhere else; drift so slow that no single step stands out is faint in it.
Eigen::MatrixXd evaluate_signal(const std::string& name, std::span<const Pose3> poses);

/// What the robot is off by, as a vector field along the server's estimate, n x 6: in position [m] after one rigid
/// alignment of all nodes, and in rotation [rad] after taking off the mean over all nodes. Linear in the poses' errors
/// as long as these are small; in the axes of the server's world; unchanged when the robot's poses are moved by one
/// rigid transform. What is filtered when both live on one graph.
Eigen::MatrixXd pose_difference(std::span<const Pose3> server, std::span<const Pose3> robot);

}  // namespace tutti::consistency
