// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

#include "tutti/estimation/robust_loss.hpp"
#include "tutti/estimation/termination.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::estimation {

struct SolverConfig {
  int max_iterations = 50;                 ///< Limit on the Gauss-Newton steps; 0 only initialises.
  double relative_cost_tolerance = 1e-9;   ///< Converged when a step can lower the cost by less than this share of it.
  std::string initialisation = "chordal";  ///< Start from the measurements alone; "given": from the given poses.
  RobustLoss loss;                         ///< On the robust edges, in standard deviations.
};

/// Whether an edge may be wrong: `trusted` edges (odometry) never get a robust loss.
enum class EdgeRole : unsigned char { trusted, robust };

/// Roles for a graph that does not mark odometry: edges between consecutive nodes are trusted, all
/// others robust.
std::vector<EdgeRole> roles_from_numbering(const PoseGraph& graph);

struct SolveSummary {
  Termination termination = Termination::not_run;
  int iterations = 0;
  int factorisations = 0;       ///< Factorisations of the Hessian; for GNC those of all its solutions together.
  double initial_cost = -1.0;   ///< Sum of rho(r^T Omega r) (chi2 without a loss) at the initial poses.
  double final_cost = -1.0;     ///< The same at the returned poses.
  double gradient_norm = -1.0;  ///< Largest entry of J^T Omega r at the last linearisation.
  double step_norm = -1.0;      ///< Largest entry of the last step (m, rad).
  /// Largest entries of all steps since the Hessian was factorised together; infinite if it was not.
  double moved_since_factorised = std::numeric_limits<double>::infinity();
  int components = 0;  ///< Connected components of the graph; each has its own gauge.
};

struct PoseGraphSolution {
  std::vector<Pose3> poses;
  SolveSummary summary;
  std::vector<double> weights;  ///< Per edge: rho' at the solution, 1 where the loss does not apply.
};

/// Minimises sum rho(r^T Omega r) over the edges (r: between_factor.hpp) by Gauss-Newton on sparse Cholesky with step
/// halving. The first node of each connected component keeps its given pose. `roles`: per edge, or empty: all robust.
/// Deterministic. Numerical failures are in the summary. Edge indices out of range are a bug of the caller.
PoseGraphSolution solve_pose_graph(const PoseGraph& graph, const SolverConfig& config,
                                   std::span<const EdgeRole> roles = {});

/// Whether a solution of this cost counts as cheaper than one of `other`: two whose costs differ by less than a
/// millionth are one, reached from two sides.
bool is_cheaper(double cost, double other);

/// Sum of r^T Omega r over all edges at the graph's poses (r: between_factor.hpp).
double chi2(const PoseGraph& graph);

}  // namespace tutti::estimation
