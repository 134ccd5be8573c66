// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/internal/graph_equations.hpp"
#include "tutti/estimation/onboard_smoother.hpp"

/// A chain of odometry reduced to its constrained nodes. A *run* is the odometry between two neighbouring ones,
/// compounded into one factor; its ends are positions in the chain.
namespace tutti::estimation::internal {

/// Positions in the chain of the reduced graph's nodes, increasing: the first pose and every constrained one.
std::vector<std::size_t> reduced_nodes(std::span<const ChainConstraint> constraints);

/// Makes `runs` those between `nodes`; what is in it already stays. Returns how many odometry steps were compounded.
std::size_t update_runs(std::span<const std::size_t> nodes, const LongList<RelativePose>& odometry,
                        std::vector<PoseGraphEdge>& runs);

/// Node k is the k-th reduced one, composed from raw odometry; edge k is run k, then come the constraints.
PoseGraph reduced_graph(std::span<const std::size_t> nodes, std::span<const PoseGraphEdge> runs,
                        std::span<const ChainConstraint> constraints, const Pose3& first);

/// Gives the nodes their poses, `reduced`, and bends raw odometry between them to meet these.
void place(std::span<const PoseGraphEdge> runs, std::span<const Pose3> reduced, const LongList<RelativePose>& odometry,
           LongList<Pose3>& poses);

/// One Gauss-Newton step on the full graph of the chain, poses after the last node left out: every run is linearised
/// about `poses` instead of raw odometry and put in its place in `graph` (that of `equations`), which is then the exact
/// Schur complement. Taken only if the full graph's cost does not rise: where odometry knows little of some axes and
/// much of others, Gauss-Newton can lead metres away from where it started. Else, or when singular, false and `poses`
/// stay.
bool polish(std::span<const std::size_t> nodes, const LongList<RelativePose>& odometry, PoseGraph& graph,
            GraphEquations& equations, LongList<Pose3>& poses);

}  // namespace tutti::estimation::internal
