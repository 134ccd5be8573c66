// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <span>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/estimation/odometry_trial.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::server {

/// A way over odometry and closures back to where it began.
struct OdometryLoop {
  Vector6d missed;    ///< By how far it fails to close (right tangent at its end: m, rad).
  Matrix6d odometry;  ///< Covariance of `missed` that is odometry's, as stated,
  Matrix6d closures;  ///< ... and what is the closures'.
};

/// The loops that tell of each robot's odometry, every robot of `chains` among them: its closures with itself; and with
/// every other robot pairs of closures, half their number apart, with both odometries between them, which tell of both
/// robots. Half their number apart, because odometry, not the closures, is to be judged. Loops over a gap in odometry
/// are left out.
std::map<ChainId, std::vector<OdometryLoop>> odometry_loops(std::span<const estimation::OdometryChain> chains,
                                                            std::span<const LoopClosure> closures);

}  // namespace tutti::server
