// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "tutti/geometry/pose3.hpp"

namespace tutti::consistency {

/// The function on the synchronised nodes that server and robot compare, each filtered on its own graph: n poses in
/// time order -> n x d, metres. It does not change when one rigid transform moves all poses, because the two graphs are
/// in unrelated frames. docs/math.md says what each signal can and cannot see. An unknown `name` throws; known are
///   "distance": the paper's, ||x_n - x_0||. It is blind to any rotation about node 0, and nearly so to displacements
///   across the line of sight from node 0; "pose": the position of node n in the frame of node 0. It shows where drift
///   has carried a robot rather than where the drift was born; "relative_motion": the position of node n in the frame
///   of node n - 1, and zero for the first. It shows every bend where it happens and nowhere else, but hardly shows
///   drift so slow that no single step stands out.
Eigen::MatrixXd evaluate_signal(const std::string& name, std::span<const Pose3> poses);

/// The robot's error as a vector field along the server's estimate, n x 6: in position [m] after one rigid alignment of
/// all nodes, and in rotation [rad] after subtracting the mean over all nodes. Components are along the axes of the
/// server's world. Linear in the errors of the poses while these are small, and unchanged when one rigid transform
/// moves all of the robot's poses. It is what gets filtered when both sides are on one graph.
Eigen::MatrixXd pose_difference(std::span<const Pose3> server, std::span<const Pose3> robot);

}  // namespace tutti::consistency
