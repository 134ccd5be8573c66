// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/robot_alone.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/mission/misfit_record.hpp"
#include "tutti/mission/robot_actor.hpp"

namespace tutti::mission {

FitAlone fit_alone(const MissionRecording& recording, const MissionConfig& config,
                   const std::function<bool(double share)>& stop) {
  RobotActor robot(recording, config.agent, config.association, nullptr);
  const Trajectory& odometry = recording.recording.odometry;
  const double begin_s = recording.start_s;
  const double duration_s = odometry.empty() ? 0.0 : odometry.back().stamp - odometry.front().stamp;
  while (std::isfinite(robot.next_time())) {
    const double time_s = robot.next_time();
    if (stop && stop(duration_s > 0.0 ? (time_s - begin_s) / duration_s : 1.0)) break;
    robot.replay_next(kMissionStart + time_s);
    robot.take_step();
  }
  return {robot.misfits(), robot.node().agent().fit().registrations()};
}

std::vector<std::string> correct_robots(const std::vector<MissionRecording>& recordings, MissionConfig& config) {
  std::vector<std::string> out;
  for (const MissionRecording& recording : recordings) {
    const std::string& name = recording.recording.name;
    const auto robot = std::ranges::find(config.robots, name, &RobotConfig::name);
    if (robot == config.robots.end() || !recording.scan_setup) continue;
    for (const fit::Misfit& misfit : fit_alone(recording, config).misfits) {
      const auto setup = corrected_setup(misfit, *recording.scan_setup);
      if (!setup) continue;
      const Eigen::Vector3d &t = setup->T_body_lidar.translation, rpy = to_rpy_deg(setup->T_body_lidar.rotation);
      if (misfit.kind == fit::MisfitKind::clock)
        robot->scan_time_offset_s = setup->time_offset_s;
      else
        robot->T_body_lidar = {.translation_m = {t.x(), t.y(), t.z()}, .rpy_deg = {rpy.x(), rpy.y(), rpy.z()}};
      out.push_back(
          fmt::format("{}: {}; corrected, as is asked for{}", name, to_string(misfit), to_paste(misfit, recording)));
    }
  }
  return out;
}

}  // namespace tutti::mission
