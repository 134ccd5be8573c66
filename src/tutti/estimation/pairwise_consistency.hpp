// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::estimation {

/// One robot's odometry over its keyframes.
struct OdometryChain {
  RobotId robot;
  std::uint32_t first_index = 0;          ///< KeyframeId::index of T_odom_body[0]; the others count up from it.
  std::vector<Pose3> T_odom_body;         ///< Raw odometry.
  std::vector<Matrix6d> step_covariance;  ///< Of keyframe k -> k + 1 (right tangent); one fewer than poses.
};

struct PairwiseConsistencyConfig {
  double confidence = 0.999;
  std::uint64_t max_search_steps = 5'000'000;

  template <class V>
  void describe(V& v) {
    v.field("confidence", confidence, between(0.5, 0.999999999), "Share of pairs of true closures that should pass.");
    v.field("max_search_steps", max_search_steps, at_least(0.0),
            "Vertices visited by the exact clique search per group; beyond, the best clique found counts.");
  }
};

/// All closures between one pair of robots, or within one robot (first == second).
struct ConsistencyGroup {
  RobotId first;  ///< first <= second
  RobotId second;
  std::vector<std::size_t> closures;  ///< Positions in the input, by (KeyframeIds, measurement).
  std::vector<std::size_t> accepted;  ///< The largest mutually consistent subset, same order.
  bool is_maximum = false;            ///< The search proved that there is no larger one.
};

struct PairwiseConsistencyResult {
  std::vector<bool> accepted;            ///< Per input closure.
  std::vector<ConsistencyGroup> groups;  ///< By (first, second).
};

/// Pairwise consistent measurement set maximisation (Mangelson, Dominic, Eustice, Vasudevan, ICRA 2018): two closures
/// a, b of one group agree when the 4-cycle a - odometry of the second robot - b^-1 - odometry of the first robot
/// closes within the chi-square quantile (6 dof) of its covariance *compounded along the odometry between them*, so
/// closures far apart are not held to one rigid transform (which loses true ones under drift). The largest set of
/// pairwise agreeing closures of a group is its maximum clique: exact branch and bound, bounded in steps (the default:
/// below a second). A lone closure of a group is accepted (nothing contradicts it): the caller may ask for more by the
/// group's size. The accepted set does not depend on the order of the input. Closures that name an unknown robot or
/// keyframe, or carry NaN or a covariance that is not positive definite, are never accepted and belong to no group.
PairwiseConsistencyResult pairwise_consistency(std::span<const OdometryChain> chains,
                                               std::span<const LoopClosure> closures,
                                               const PairwiseConsistencyConfig& config = {});

}  // namespace tutti::estimation
