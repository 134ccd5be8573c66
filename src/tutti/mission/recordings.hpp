// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/model/point_cloud.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// A robot's recording and what is known about it beside the mission (never shown to robots or server).
struct MissionRecording {
  Recording recording;
  Pose3 T_odom_recorded;  ///< The drawn frame: the replayed odom frame from the recorded one.
  double start_s = 0.0;   ///< Mission time of the first sample.
  bool score_against_reference = true;
  /// Where this robot's odometry frame lies in the common reference frame, when the reference is the recorded odometry
  /// itself (so it is exact up to the reference's own error).
  std::optional<Pose3> T_common_odom;
  std::vector<std::string> notes;  ///< What was taken for granted of it, for the report.
};

struct MissionInput {
  std::vector<MissionRecording> robots;
  std::shared_ptr<const PointCloud> survey;  ///< What the place really looks like, reference frame; null when unknown.
};

/// Replays or simulates every robot of the mission. `data` is the --data folder (may be empty for simulated robots).
Result<MissionInput> load_input(const MissionConfig& config, const std::filesystem::path& data, std::uint64_t seed);

}  // namespace tutti::mission
