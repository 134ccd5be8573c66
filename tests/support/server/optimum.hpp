// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server::test {

/// The factors of the map cost no more at its poses than at any other solution that is found from the measurements: by
/// the chordal relaxation, or from dead reckoning. Not asked are maps that bundle adjustment refines, and those where
/// odometry was found to have failed, as their graph is less sure of that segment than the solution's was.
inline void expect_optimum(const MapServer& server) {
  const MapEstimate& map = server.map();
  if (!server.state().refinements.all().empty()) return;
  if (!map.converged || !map.failed_odometry.empty() || map.degrees_of_freedom == 0) return;
  PoseGraph anew = map.graph;
  for (std::size_t i = 0; i < anew.poses.size(); ++i) anew.poses[i] = map.nodes[i].T_odom_body;
  const double cost = estimation::chi2(map.graph);
  EXPECT_NEAR(map.cost, cost, 1e-6 * cost + 1e-9);
  for (const char* initialisation : {"chordal", "given"}) {
    const auto other = estimation::solve_pose_graph(anew, {.initialisation = initialisation});
    ASSERT_TRUE(estimation::is_usable(other.summary.termination));
    EXPECT_FALSE(estimation::is_cheaper(other.summary.final_cost, map.cost))
        << "revision " << server.state().revision << ", " << initialisation << ": " << other.summary.final_cost
        << " instead of " << map.cost;
  }
}

}  // namespace tutti::server::test
