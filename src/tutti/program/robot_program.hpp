// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/feed/feed_server.hpp"
#include "tutti/program/mission_source.hpp"

namespace tutti::program {

inline constexpr const char* kRobotFile = "robot.tutti";  ///< In a robot's state folder.

struct RobotOptions {
  std::string name;  ///< One of the mission's; any, when it is fed.
  std::string bus;   ///< "nats://HOST:PORT"
  bool insecure = false;
  std::filesystem::path state;
  MissionSource mission;  ///< Its recording is replayed,
  std::string feed;       ///< unless samples come on this Unix socket; then it may be empty.
  FeedAccess feed_access;
  double rate = 1.0;                                          ///< Times real time.
  double uplink_bytes_per_s = 0.0;                            ///< Of mission time, for submaps; 0: no limit.
  std::uint64_t max_archive_bytes = std::uint64_t{1} << 30U;  ///< Of submaps that the server has.
  bool stay = false;                                          ///< After the recording, to hear later maps.
  std::optional<std::uint64_t> session;                       ///< Nothing: when the state folder was made.
  Level console = Level::warning;
  std::string version;
};

/// Replays the robot's recording, or takes what clients feed, from where an earlier program of this state folder
/// stopped. Ends at `stop`; or, unless it is to stay, when the recording has ended, the server has stored all its
/// submaps, and the robot has heard a map that contains them or waited 60 s for it.
Status run_robot(const RobotOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::program
