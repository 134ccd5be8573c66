// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>
#include <vector>

#include "tutti/estimation/gnc.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/judge/explain_closures.hpp"
#include "tutti/judge/settings.hpp"
#include "tutti/judge/settle.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/map_node.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::judge {

/// Why a closure is not in the map.
enum class Objection {
  none,          ///< The closure is in the map.
  operators,     ///< An operator has rejected it.
  fixes,         ///< Fixes of both robots contradict it (server/refuted_closures.hpp).
  contradicted,  ///< Odometry and other closures contradict it (explain_closures.hpp).
  too_few,       ///< Too few closures join these two segments of odometry.
  dear,          ///< The map would pay more for it than a right one costs (settle.hpp).
  lone,          ///< With the other closures of its pair of places it contradicts all the rest of the map.
  outvoted,      ///< Nearly all closures of these two robots contradict odometry, and no map follows from the rest.
  no_map         ///< The map could not be solved.
};
const char* to_string(Objection objection);  ///< The rule, for people; empty for none.
/// The rule with its numbers. Has no comma.
std::string reason_of(Objection objection, const Price& price);

using NodeIndex = std::unordered_map<KeyframeId, std::size_t>;

/// The closures of all verdicts on submaps in the map, in a fixed order.
struct Closures {
  std::vector<LoopClosure> judged;
  std::vector<bool> certain;          ///< Per judged closure whether an operator has accepted it.
  std::vector<LoopClosure> rejected;  ///< Rejected by an operator.
  std::vector<LoopClosure> refuted;   ///< Refuted by position fixes.
};

/// The map that follows from a judgement of the closures.
struct Optimum {
  std::vector<FailedSegment> failed;
  PoseGraph graph;                           ///< Odometry, weakened where it failed, and the closures of the map.
  std::vector<std::size_t> closure_of_edge;  ///< Per edge beyond odometry its position in Closures::judged.
  estimation::PoseGraphSolution solution;
  bool from_measurements = false;     ///< Solved from the measurements alone it costs less than from where its closures
                                      ///< were decided, and that is the solution.
  std::vector<Objection> objections;  ///< Per judged closure.
  std::vector<Price> prices;          ///< Per judged closure.
  SearchWork work;                    ///< The cost, with that of the optima before this one.
};

/// A map without closures, as input of judge_closures(), which keeps no references.
struct OdometryGraph {
  const std::vector<MapNode>& nodes;
  const PoseGraph& graph;     ///< Over the nodes; its first odometry_edges edges are odometry.
  const PoseGraph& searched;  ///< The same, with rotations as certain as the closures show them to be: which closures
                              ///< and which odometry are wrong is looked for with these weights.
  std::size_t odometry_edges = 0;
};

/// Decides which closures the map is made with and which odometry has failed: explain_closures(), then, up to five
/// times, refusal of the group of closures that alone contradicts the rest of the map (docs/math.md, "Lone witnesses");
/// what was refused so is asked again when the map no longer changes. The poses cost no more than those of the same
/// factors solved from their measurements alone. `index`: of each keyframe its position among the nodes. Closures that
/// are certain are never refused. Numerical failures are in Optimum::solution.
Optimum judge_closures(const OdometryGraph& map, const NodeIndex& index, const Closures& closures,
                       const OutlierRejectionConfig& config, const estimation::GncConfig& gnc);

/// The inverse of a covariance to which the variances of kLeastTranslation_m and kLeastRotation_rad were added: tighter
/// measurements would only make the normal equations stiff.
Matrix6d information_of(const Matrix6d& covariance);

/// Adds the variances sigma_m^2 and sigma_rad^2 to failed odometry between the nodes `from` and `to`, in equal shares
/// to the steps of the segment.
void weaken(PoseGraph& graph, std::size_t odometry_edges, std::size_t from, std::size_t to, double sigma_m,
            double sigma_rad);

}  // namespace tutti::judge
