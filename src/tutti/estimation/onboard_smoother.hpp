// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/model/long_list.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::estimation {
namespace internal {
class GraphEquations;
}

struct OnboardSmootherConfig {
  int max_iterations = 20;                ///< Limit on the Gauss-Newton steps on the reduced graph.
  double relative_cost_tolerance = 1e-6;  ///< Converged when a step can lower the cost by less than this share of it.
  /// Limit on the Gauss-Newton steps on the full graph after the reduced one; none that raises its cost is taken.
  int polishing_steps = 0;
};

/// A relative pose between two nodes of the chain, positions as returned by append().
struct ChainConstraint {
  std::size_t from = 0;
  std::size_t to = 0;
  RelativePose measurement;
  friend bool operator==(const ChainConstraint&, const ChainConstraint&) = default;
};

struct SmootherSummary {
  Termination termination = Termination::not_run;
  int iterations = 0;          ///< On the reduced graph.
  double initial_cost = -1.0;  ///< The reduced graph's: compounded odometry and the constraints.
  double final_cost = -1.0;
  /// Polishing steps that were taken; one that would raise the cost of the full graph is not.
  int polishing_steps = 0;
  std::size_t reduced_nodes = 0;
  std::size_t reduced_edges = 0;
  /// Odometry steps that had to be compounded, because their run was not in the last solve.
  std::size_t compounded_steps = 0;
};

/// All that a smoother knows, except for what it can compute again. Poses grow with the chain and all change at every
/// solve, but most follow from the rest: to restore all of them to the bit, the first `held` poses or `solution` are
/// enough.
struct SmootherState {
  Pose3 first;
  LongList<RelativePose> odometry;
  std::vector<ChainConstraint> constraints;
  /// T_map_body per node, one more than odometry steps, as the last solve left them; the next solve starts there. A
  /// smoother can be restored from fewer poses: those that are missing at the end follow by odometry from the last one
  /// given, and if none are given all follow from `solution`.
  LongList<Pose3> poses;
  /// Poses of the reduced graph of `constraints`, before polishing, if the last solve was usable. Empty if there was no
  /// such solve: then all poses but the first `held` ones are composed from odometry.
  std::vector<Pose3> solution;
  std::size_t held = 0;  ///< Number of poses, from the first on, that do not follow from the rest.
  friend bool operator==(const SmootherState&, const SmootherState&) = default;
};

/// A robot's own optimiser: one odometry chain and relative constraints between some of its nodes. Each run of odometry
/// between two constrained nodes is compounded, with covariance, into one factor; Gauss-Newton solves the small graph
/// of constrained nodes; each run's inner poses follow exactly in closed form (the smoother of a linear-Gaussian chain
/// with fixed ends); nodes after the last constrained one are composed from odometry. A polishing step repeats this
/// about the current poses instead of the raw odometry, which makes it a Gauss-Newton step on the full graph; it is
/// taken only when the full graph's cost does not rise. docs/math.md, "Onboard smoother", derives all of it.
///
/// No robust loss is applied to constraints (docs/math.md says why). A solve starts from the poses of the last one and
/// reuses the compounds of runs that stayed. The estimate is still a function of odometry and constraints, to a
/// tolerance: the same calls give the same bits, also from a restored state; another history of calls, or a state
/// without its poses, gives the same poses to 0.1 mm. One thread at a time.
class OnboardSmoother {
 public:
  explicit OnboardSmoother(const OnboardSmootherConfig& config = {}, const Pose3& first = {});
  OnboardSmoother(const OnboardSmootherConfig& config, SmootherState state);

  /// Adds a node, `odometry` from the last one (T_last_new with a positive definite covariance), and returns its
  /// position. Its pose is composed from odometry until the next solve().
  std::size_t append(const RelativePose& odometry);
  /// Number of nodes: one more than odometry steps.
  [[nodiscard]] std::size_t size() const { return state_.poses.size(); }
  /// Replaces all constraints. Their nodes must exist; a constraint with from == to is ignored.
  void set_constraints(std::vector<ChainConstraint> constraints);
  /// Moves the fixed first pose; every pose follows rigidly.
  void set_first_pose(const Pose3& T_map_first);
  /// On failure (singular, invalid_input) the poses stay as they were.
  SmootherSummary solve();

  [[nodiscard]] Pose3 pose(std::size_t node) const { return state_.poses[node]; }
  [[nodiscard]] std::vector<Pose3> poses() const { return state_.poses.all(); }  ///< T_map_body per node.
  [[nodiscard]] const SmootherState& state() const { return state_; }

  /// Size that SmootherState::solution has for these constraints.
  static std::size_t solution_size(const std::vector<ChainConstraint>& constraints);

 private:
  void hold();
  /// Computes all poses from the solution; returns the number of polishing steps.
  int spread(const std::vector<std::size_t>& nodes, PoseGraph& graph, internal::GraphEquations& equations);
  void compose_from(std::size_t node);
  void restore_solution(std::vector<Pose3> solution);

  OnboardSmootherConfig config_;
  SmootherState state_;
  std::vector<PoseGraphEdge> runs_;  ///< Compounded odometry between the reduced nodes of the last solve.
};

}  // namespace tutti::estimation
