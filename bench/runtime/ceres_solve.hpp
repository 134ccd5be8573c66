// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/model/pose_graph.hpp"

namespace tutti::bench {

/// The optimum by Ceres on one thread, from the graph's poses, first pose fixed; sparse Cholesky (SuiteSparse), trust
/// radius 1e12 (its default crawls on a long chain of odometry), derivatives by automatic differentiation.
std::vector<Pose3> solve_with_ceres(const PoseGraph& graph);

}  // namespace tutti::bench
