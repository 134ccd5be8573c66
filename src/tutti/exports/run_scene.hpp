// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/exports/scene.hpp"

namespace tutti::exports {

/// A folder that `tutti run` has written (docs/report.md): every robot's onboard, corrected, server and reference way;
/// frames world -> ROBOT/map -> ROBOT/odom -> ROBOT/base_link, of which the first is where its corrected way meets the
/// server's best, as neither knows the other's frame; the map's and the survey's cloud; accepted closures; how far
/// odometry and correction are from the server's way at every keyframe; what was suspected and alerted. Stamps are the
/// mission's time, counted from the first stamp of the robot that began it: robots' clocks need not agree. What the
/// folder has not (a closure that was refused is only counted there) is not in the scene.
Result<Scene> scene_of_run(const std::string& folder);

}  // namespace tutti::exports
