// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/exports/scene.hpp"

namespace tutti::exports {

/// A folder that `tutti run` has written (docs/report.md) as a scene: every robot's onboard, corrected, server and
/// reference trajectory; the frames world -> ROBOT/map -> ROBOT/odom -> ROBOT/base_link; the clouds of the map and of
/// the survey; accepted closures; how far odometry and correction are from the server's estimate at every keyframe;
/// suspected origins of drift and alerts. T_world_map is the best alignment of the corrected trajectory with the
/// server's, because neither side knows the other's frame. Stamps are the mission's time, counted from the first stamp
/// of the robot that began it, so robots' clocks need not agree. Refused closures are missing, because the folder only
/// counts them. Errors name the file that is missing or damaged.
Result<Scene> scene_of_run(const std::string& folder);

}  // namespace tutti::exports
