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
  std::string robot;   ///< A robot of the mission.
  std::string socket;  ///< Path of the live feed of the robot's program; it need not exist yet.
  double rate = 1.0;   ///< Speed, as a multiple of real time.
  /// Folder for scores of every update against the reference (kUpdateScored in events.jsonl); empty: nothing is scored.
  std::filesystem::path scores;
};

/// Plays a simulated or recorded robot of a mission over the live feed of its program, as its driver would: odometry
/// when it is due, with it IMU samples, fixes, ranges and images, and the scans that the robot wants. With `scores` it
/// then listens to the robot's corrections until `stop`; otherwise it returns when the end of the recording is stored.
/// Fails when the connection ends earlier.
Status play_feed(const FeedPlayerOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::lab
