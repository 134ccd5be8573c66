// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
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

/// A recorded odometry, changed before it is replayed.
struct ChangedOdometry {
  Trajectory odometry;    ///< Of the same stamps.
  Pose3 T_odom_recorded;  ///< MissionRecording
  bool is_bent = false;   ///< Not only moved as a whole.
};
using ChangeOdometry = std::function<ChangedOdometry(Trajectory recorded)>;

/// Reads the recording of every robot of the mission; `data` is the folder that their files' names are relative to.
/// `changes`: to the robots by their places, for tests and experiments; those behind the last are replayed as they are.
Result<MissionInput> load_input(const MissionConfig& config, const std::filesystem::path& data, std::uint64_t seed,
                                const std::vector<ChangeOdometry>& changes = {});
/// What load_input() does last, and what recordings from elsewhere need, too: checks that references are by the clock
/// of the odometry, and gives robots odometry at the mission's rate.
Status fit_input(const MissionConfig& config, std::uint64_t seed, std::vector<MissionRecording>& robots);

}  // namespace tutti::mission
