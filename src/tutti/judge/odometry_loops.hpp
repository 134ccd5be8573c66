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

/// Odometry of one chain without a gap: a piece of it. A chain may have several, which do not overlap.
struct OdometryChain {
  ChainId id;
  std::uint32_t first_index = 0;          ///< KeyframeId::index of T_odom_body[0]; the others count up from it.
  std::vector<Pose3> T_odom_body;         ///< Raw odometry.
  std::vector<Matrix6d> step_covariance;  ///< Of keyframe k -> k + 1 (right tangent); one fewer than poses.
};

/// A way over odometry and closures back to where it began.
struct OdometryLoop {
  Vector6d missed;          ///< By how far it fails to close (right tangent at its end: m, rad).
  Matrix6d odometry;        ///< Covariance of `missed` that is odometry's, as stated,
  Matrix6d closures;        ///< ... and what is the closures'.
  std::uint32_t first = 0;  ///< KeyframeId::index: of the robot's own odometry it goes over these keyframes,
  std::uint32_t last = 0;   ///< ... inclusive.
};

/// The loops that tell of each robot's odometry, every robot of `chains` among them: its closures with itself; and with
/// every other robot pairs of closures, half their number apart, with both odometries between them, which tell of both
/// robots. Half their number apart, because odometry, not the closures, is to be judged. Loops over a gap in odometry
/// are left out.
std::map<ChainId, std::vector<OdometryLoop>> odometry_loops(std::span<const OdometryChain> chains,
                                                            std::span<const LoopClosure> closures);

/// Two closures between the same two chains, with the odometry between their ends.
struct ClosurePair {
  LoopClosure first;    ///< Both from the chain with the smaller id, or from the earlier keyframe.
  LoopClosure second;   ///< Begins no earlier than `first`.
  RelativePose of_one;  ///< Odometry from first.from to second.from,
  RelativePose of_two;  ///< ... and from first.to to second.to.
};

/// One way by closure, then odometry of the second chain; the other by odometry of the first, then closure.
OdometryLoop loop_of(const ClosurePair& pair);

/// Of each two chains with closures (or of one with itself) every closure and the nearest other one, by the larger
/// distance in keyframes of their two ends, without gaps in odometry between them; each pair once.
std::map<std::pair<ChainId, ChainId>, std::vector<ClosurePair>> neighbouring_closures(
    std::span<const OdometryChain> chains, std::span<const LoopClosure> closures);

}  // namespace tutti::judge
