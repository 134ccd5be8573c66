// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "tutti/estimation/gnc.hpp"
#include "tutti/judge/explain_closures.hpp"
#include "tutti/judge/settings.hpp"
#include "tutti/model/loop_closure.hpp"
#include "tutti/model/map_node.hpp"
#include "tutti/model/pose_graph.hpp"

namespace tutti::judge {

/// Why a closure is not in the map.
enum class Objection {
  none,          ///< It is.
  operators,     ///< An operator has rejected it.
  contradicted,  ///< Odometry and the other closures tell otherwise (explain_closures.hpp).
  too_few,       ///< Too few closures join these two pieces of odometry.
  misfit,        ///< It does not fit the map that the others make.
  lone,          ///< With those of its place it contradicts all the rest of the map.
  no_map         ///< The map could not be solved.
};
const char* to_string(Objection objection);  ///< For people; empty for none.

using NodeIndex = std::unordered_map<KeyframeId, std::size_t>;

/// Closures of all verdicts on submaps in the map, in a fixed order.
struct Closures {
  std::vector<LoopClosure> judged;
  std::vector<bool> certain;          ///< Of those: an operator has accepted it.
  std::vector<LoopClosure> rejected;  ///< By an operator.
};

/// What an explanation of the closures makes of the map.
struct Optimum {
  std::vector<FailedStretch> failed;
  PoseGraph graph;                           ///< Odometry, let go where it failed, and the closures not rejected.
  std::vector<std::size_t> closure_of_edge;  ///< Of the edges beyond odometry.
  estimation::GncResult robust;
  std::vector<std::size_t> fitting;   ///< Edges of closures that fit the map.
  std::vector<Objection> objections;  ///< To each closure.
  SearchWork work;                    ///< What it took, with the optima before this one.
};

/// A map without closures. References live only for the call.
struct OdometryGraph {
  const std::vector<MapNode>& nodes;
  const PoseGraph& graph;  ///< Of the nodes: odometry in its first edges.
  std::size_t odometry_edges = 0;
};

/// Which closures the map is made with, and which odometry is let go. `index`: of each keyframe among the nodes.
/// Closures that an operator is certain of are never refused.
Optimum judge_closures(const OdometryGraph& map, const NodeIndex& index, const Closures& closures,
                       const WhoIsWrongConfig& config, const estimation::GncConfig& gnc);

/// The inverse of a covariance, with a floor: stiffer normal equations tell nothing.
Matrix6d information_of(const Matrix6d& covariance);

/// Adds a variance (m, rad) to failed odometry between two nodes, in equal shares to the steps of the stretch.
void weaken(PoseGraph& graph, std::size_t odometry_edges, std::size_t from, std::size_t to, double sigma_m,
            double sigma_rad);

}  // namespace tutti::judge
