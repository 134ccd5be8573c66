// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::server {

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

}  // namespace tutti::server
