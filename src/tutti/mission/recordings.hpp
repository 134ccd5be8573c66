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
#include "tutti/model/relative_pose.hpp"

namespace tutti::mission {

/// A closure that came with a recording, and when its server got it.
struct RecordedClosure {
  std::string from;  ///< The other robot, by its letter in the graph.
  Timestamp from_stamp;
  Timestamp to_stamp;  ///< By the clock of the robot that has the closure.
  RelativePose measurement;
  Timestamp arrived;
};

/// A robot's recording, with what is known about it besides (and never shown to robots or server).
struct MissionRecording {
  Recording recording;
  Pose3 T_odom_recorded;  ///< T_odom_recorded: the recorded odometry frame in the replayed one.
  double start_s = 0.0;   ///< Mission time of the first sample.
  bool score_against_reference = true;
  /// T_common_odom, when the reference is the recorded odometry itself (so it is exact up to the reference's own
  /// error).
  std::optional<Pose3> T_common_odom;
  /// How its scans were taken to be, which a misfit's setting corrects; nothing where that cannot be set.
  struct ScanSetup {
    Pose3 T_body_lidar;
    double time_offset_s = 0.0;
  };
  std::optional<ScanSetup> scan_setup;
  std::string graph, graph_robot;         ///< File and letter of the graph that it is from; empty: from none.
  std::vector<RecordedClosure> closures;  ///< Those of the graph that end at this robot.
  std::vector<std::string> notes;         ///< Assumptions made about the recording, for the report.
  std::vector<std::string> warnings;      ///< Where much of it is left out, with what to type (much_left_out()).
};

/// The recordings of a mission.
struct MissionInput {
  std::vector<MissionRecording> robots;
  std::shared_ptr<const PointCloud> survey;  ///< Points of the real surface, in the reference frame; null when unknown.
};

/// Recorded odometry that was changed before it is replayed.
struct ChangedOdometry {
  Trajectory odometry;    ///< With the same stamps.
  Pose3 T_odom_recorded;  ///< As MissionRecording::T_odom_recorded.
  bool is_bent = false;   ///< It was changed otherwise than by one rigid transform.
};
using ChangeOdometry = std::function<ChangedOdometry(Trajectory recorded)>;

/// Reads the recording of every robot of the mission; `data` is the folder that their file names are relative to.
/// `changes` apply to robots by position, for tests and experiments; robots beyond its end are replayed as they are.
/// Fails when a file cannot be read or data do not fit together.
Result<MissionInput> load_input(const MissionConfig& config, const std::filesystem::path& data, std::uint64_t seed,
                                const std::vector<ChangeOdometry>& changes = {});
/// The last part of load_input(), also for recordings from elsewhere: checks that references use the odometry's clock,
/// and resamples odometry to the mission's rate.
Status fit_input(const MissionConfig& config, std::uint64_t seed, std::vector<MissionRecording>& robots);

}  // namespace tutti::mission
