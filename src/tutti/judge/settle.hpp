// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/judge/settings.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::judge {

/// The most that a map pays for one of `asked` witnesses (closures, or groups of closures at one pair of places): the
/// share config.right_refused of maps whose witnesses are all right refuses any of them by chance. Chi-square of 6
/// degrees of freedom exceeds it for that share over `asked`.
double most_paid(const OutlierRejectionConfig& config, std::size_t asked);

/// The same for a closure of so many, where few are judged as more would be.
double most_paid_for_closure(const OutlierRejectionConfig& config, std::size_t closures);

/// The price that the map pays for a closure, or would, and the most that it pays for one.
struct Price {
  double paid = std::numeric_limits<double>::infinity();  ///< Infinite: not known.
  double most = 0.0;
};

/// The result of settle_closures().
struct Settled {
  std::vector<char> in;       ///< Per closure whether the map is made with it.
  std::vector<Price> prices;  ///< Per closure.
  std::vector<Pose3> poses;   ///< Per node.
  estimation::Termination termination = estimation::Termination::not_run;
  std::size_t factorisations = 0;
};

/// Asks every closure for its price until none changes sides: what the map pays for it is its error against its own
/// covariance and the map's (estimation/switched_graph.hpp), chi-square of 6 degrees of freedom where both are right,
/// and at most most_paid(). The poses cost no more than those that the same factors have when they are solved from
/// their measurements alone. `graph`: its first `odometry_edges` edges are odometry, all others closures; `in`: per
/// closure whether the map begins with it. Closures that begin outside are taken in generously at first, since a map
/// without right closures is farther off than its covariance states. `certain`: per closure whether it is in whatever
/// it costs. A closure between two parts that no others join has no price and stays outside.
Settled settle_closures(const PoseGraph& graph, std::size_t odometry_edges, std::vector<char> in,
                        const std::vector<bool>& certain, const OutlierRejectionConfig& config,
                        const estimation::SolverConfig& solver);

}  // namespace tutti::judge
