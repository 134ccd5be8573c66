// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/internal/maximum_clique.hpp"
#include "tutti/estimation/odometry_trial.hpp"

namespace tutti::estimation::internal {

/// A closure between pose i of one chain and pose j of another, or i < j of one chain.
struct PlacedClosure {
  std::size_t position = 0;  ///< In the input.
  std::size_t i = 0;
  std::size_t j = 0;
  Pose3 T_i_j;                                   ///< Measured.
  bool fits_odometry = true;                     ///< One chain: the loop over the odometry between its ends closes.
  Matrix6d loop_information = Matrix6d::Zero();  ///< One chain: inverse covariance of that loop, seen at j.
};

/// Which closures between two chains agree pairwise.
struct ConsistencyGraph {
  std::size_t first = 0;  ///< Chains, by position; the first one's keyframes are the smaller ids.
  std::size_t second = 0;
  std::vector<PlacedClosure> closures;  ///< In an order that does not depend on the input's.
  BitGraph agreement{0};
};

/// All pairs of chains that have closures, in the order of (first, second). Several chains of one robot are allowed if
/// they do not overlap. `confidence`: of a pair of true closures.
std::vector<ConsistencyGraph> consistency_graphs(std::span<const OdometryChain> chains,
                                                 std::span<const LoopClosure> closures, double confidence);

/// The graph of some of the vertices, in their order.
BitGraph induced(const BitGraph& graph, std::span<const int> vertices);

}  // namespace tutti::estimation::internal
