// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <filesystem>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_source.hpp"

namespace tutti::lab {

struct FeedPlayerOptions {
  MissionSource mission;
  std::string robot;   ///< One of the mission's.
  std::string socket;  ///< Of its program's live feed; waited for.
  double rate = 1.0;   ///< Times real time.
  /// What the robot makes of the map is scored there against the reference (kUpdateScored in events.jsonl); empty: not.
  std::filesystem::path scores;
};

/// Plays a simulated or recorded robot of a mission over the live feed of its program, as its driver would: odometry
/// when it is due, what its IMU and cameras saw with it, and the scans that the robot wants. Beside that it hears how
/// the robot corrects its way, until `stop` if that is scored, else until the end of the recording is stored. An error:
/// the connection has ended before.
Status play_feed(const FeedPlayerOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::lab
