// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/judge/settings.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::judge {

/// The most that the map pays for a closure: chi-square of 6 degrees of freedom exceeds it for the share
/// config.right_refused.
double most_paid(const OutlierRejectionConfig& config);

/// What settle_closures() ends with.
struct Settled {
  std::vector<char> in;        ///< Per closure whether the map is made with it.
  std::vector<double> prices;  ///< Per closure what the map pays for it, or would.
  std::vector<Pose3> poses;    ///< Per node.
  estimation::Termination termination = estimation::Termination::not_run;
  std::size_t factorisations = 0;
};

/// Asks every closure for its price until none changes sides: what the map pays for it is its error against its own
/// covariance and the map's (estimation/switched_graph.hpp), chi-square of 6 degrees of freedom where both are right,
/// and at most most_paid(). `graph`: its first `odometry_edges` edges are odometry, all others closures; `in`: per
/// closure whether the map begins with it. What begins outside is taken in generously at first, since a map without
/// right closures is farther off than its covariance states. `certain`: per closure whether it is in whatever it costs.
/// A closure between two parts that no others join has no price and stays outside.
Settled settle_closures(const PoseGraph& graph, std::size_t odometry_edges, std::vector<char> in,
                        const std::vector<bool>& certain, const OutlierRejectionConfig& config,
                        const estimation::SolverConfig& solver);

}  // namespace tutti::judge
