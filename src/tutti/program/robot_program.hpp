// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/perception/visual/frontend/tracking_source.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/feed/feed_server.hpp"
#include "tutti/program/robot_driver.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::program {

inline constexpr const char* kRobotFile = "robot.tutti";  ///< In a robot's state folder.
inline constexpr const char* kEnded = "ended";            ///< Its last event, with its traffic.

/// What a robot is told of its mission.
struct RobotSettings {
  std::string mission;              ///< Its name on the bus (bus::check_mission_name).
  std::vector<std::string> robots;  ///< By their number; empty: nobody has told.
  robot::AgentConfig agent;
  visual::TrackingConfig tracking;
  Rng randomness{1};  ///< Of its agent.
  /// Of these, what a mission file may say.
  template <class V>
  void describe(V& v) {
    v.field("agent", agent);
    v.field("tracking", tracking, any(), "Of the images that are fed.");
  }
};

struct RobotOptions {
  std::string name;  ///< One of the mission's; any, when it is fed.
  std::string bus;   ///< "nats://HOST:PORT"
  bool insecure = false;
  std::filesystem::path state;
  RobotSettings settings;
  std::string feed;         ///< Samples come on this Unix socket; empty: from a recording.
  ReplayMaker replay;       ///< Of that.
  double duration_s = 0.0;  ///< Of its mission; not of one that is fed.
  FeedAccess feed_access;
  double rate = 1.0;                                          ///< Times real time.
  double uplink_bytes_per_s = 0.0;                            ///< Of mission time, for submaps; 0: no limit.
  std::uint64_t max_archive_bytes = std::uint64_t{1} << 30U;  ///< Of submaps that the server has.
  bool stay = false;                                          ///< After the recording, to hear later maps.
  std::optional<std::uint64_t> session;                       ///< Nothing: when the state folder was made.
  Level console = Level::warning;
  std::string version;
};

/// Its number: the place of its name among the mission's, or, of one that is fed and is in no mission, of its name
/// alone, the same everywhere and none that a mission gives. An error: no name for a robot, or none of the mission's.
Result<RobotId> number_of(const std::string& name, const std::vector<std::string>& names, bool is_fed);

/// Replays the robot's recording, or takes what clients feed, from where an earlier program of this state folder
/// stopped. Ends at `stop`; or, unless it is to stay, when the recording has ended, the server has stored all its
/// submaps, and the robot has heard a map that contains them or waited 60 s for it.
Status run_robot(const RobotOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::program
