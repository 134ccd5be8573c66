// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "tutti/estimation/odometry_trial.hpp"

namespace tutti::server {

/// A convicted stretch and what its odometry may have missed in all (m, rad), as standard deviations; of a single step
/// that jumped, what it was instead.
struct DoubtedStretch {
  estimation::OdometryStretch stretch;
  double sigma_m = 0.0;
  double sigma_rad = 0.0;
  std::optional<RelativePose> motion;
};

/// The convicted stretches moved to where the map they made says odometry failed (estimation/failure_interval.hpp), up
/// to 40 m away; to a single step, if that one jumped (estimation/jump.hpp). All closures between a robot's way there
/// and the rest of the map count, rejected ones too. In the order of `failed`, which is sorted; none overlap.
/// `T_world_body`: of every keyframe of the chains.
std::vector<DoubtedStretch> relocate_failures(std::span<const DoubtedStretch> failed,
                                              std::span<const estimation::OdometryChain> chains,
                                              std::span<const LoopClosure> closures,
                                              const std::function<Pose3(KeyframeId)>& T_world_body);

}  // namespace tutti::server
