// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "tutti/estimation/gnc.hpp"
#include "tutti/estimation/who_is_wrong/who_is_wrong.hpp"
#include "tutti/server/map_estimate.hpp"

/// Of map_estimate.cpp: which closures the map is made with, and which odometry is let go.
namespace tutti::server {

using NodeIndex = std::unordered_map<KeyframeId, std::size_t>;

/// Closures of all verdicts on submaps in the map, in a fixed order.
struct Closures {
  std::vector<LoopClosure> judged;
  std::vector<bool> certain;          ///< Of those: an operator has accepted it.
  std::vector<LoopClosure> rejected;  ///< By an operator.
};

/// What an explanation of the closures makes of the map.
struct Optimum {
  std::vector<estimation::FailedStretch> failed;
  PoseGraph graph;                           ///< Odometry, let go where it failed, and the closures not rejected.
  std::vector<std::size_t> closure_of_edge;  ///< Of the edges beyond odometry.
  estimation::GncResult robust;
  std::vector<std::size_t> fitting;   ///< Edges of closures that fit the map.
  std::vector<Objection> objections;  ///< To each closure.
  estimation::SearchWork work;        ///< What it took, with the optima before this one.
};

/// Decides on a map whose nodes and odometry are there. Closures that an operator is certain of are never refused.
Optimum judge_closures(const MapEstimate& map, const NodeIndex& index, const Closures& closures,
                       const MapConfig& config);

/// The inverse of a covariance, with a floor: stiffer normal equations tell nothing.
Matrix6d information_of(const Matrix6d& covariance);

/// Adds a variance (m, rad) to failed odometry, in equal shares to the steps of the stretch.
void weaken(PoseGraph& graph, const MapEstimate& map, std::size_t from, std::size_t to, double sigma_m,
            double sigma_rad);

}  // namespace tutti::server
