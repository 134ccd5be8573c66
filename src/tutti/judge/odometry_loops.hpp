// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::judge {

/// A segment of a chain's odometry without a gap. A chain with missing submaps has several segments, which do not
/// overlap.
struct OdometrySegment {
  ChainId id;
  std::vector<std::uint32_t> index;       ///< KeyframeId::index of each keyframe, growing; one at least.
  std::vector<Pose3> T_odom_body;         ///< Raw odometry at each.
  std::vector<Matrix6d> step_covariance;  ///< From keyframe k to k + 1 (right tangent); one fewer than poses.
};

/// A loop over odometry and closures back to where it began.
struct OdometryLoop {
  Vector6d missed;          ///< By how much the loop fails to close (right tangent at its end: m, rad).
  Matrix6d odometry;        ///< Part of the covariance of `missed` that odometry states.
  Matrix6d closures;        ///< Part that the closures state.
  std::uint32_t first = 0;  ///< KeyframeId::index of the first keyframe that it goes over on its own chain.
  std::uint32_t last = 0;   ///< ... and of the last one.
};

/// The loops that measure each chain's odometry, with an entry for every chain in `segments`. Each closure of a chain
/// with itself is a loop; and so are, with every other chain, pairs of closures with both odometries between their
/// ends, which measure both chains. The two closures of a pair are half of their number apart, so that much odometry
/// lies between them: it, not the closures, is to be judged. Loops over a gap in odometry are left out.
std::map<ChainId, std::vector<OdometryLoop>> odometry_loops(std::span<const OdometrySegment> segments,
                                                            std::span<const LoopClosure> closures);

/// Two closures between the same two chains, with the odometry between their ends.
struct ClosurePair {
  /// Both closures are from the chain with the smaller id, or, on one chain, from the earlier keyframe.
  LoopClosure first;
  LoopClosure second;   ///< Begins no earlier than `first`.
  RelativePose of_one;  ///< Odometry from first.from to second.from.
  RelativePose of_two;  ///< Odometry from first.to to second.to.
};

/// The loop of a pair: local(first * of_two, of_one * second).
OdometryLoop loop_of(const ClosurePair& pair);

/// For every two chains with closures (or one with itself), every closure paired with its nearest other closure, each
/// pair once. Nearness is the larger distance, in keyframes, of the two closures' ends; closures between the same two
/// keyframes, and pairs with a gap in odometry between them, are left out.
std::map<std::pair<ChainId, ChainId>, std::vector<ClosurePair>> neighbouring_closures(
    std::span<const OdometrySegment> segments, std::span<const LoopClosure> closures);

}  // namespace tutti::judge
