// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/bus/transport.hpp"
#include "tutti/intake/sensor_intake.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/perception/visual/frontend/tracking_source.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/feed/live_feed.hpp"
#include "tutti/program/map_fetcher.hpp"
#include "tutti/program/robot_store.hpp"
#include "tutti/robot/agent.hpp"

namespace tutti::program {

inline constexpr const char* kEnded = "ended";  ///< The program's last event, which has its traffic and status.
inline constexpr const char* kUpdateTimed = "update_timed";  ///< The event of drive::UpdateTime.

/// A robot's mission, as its command line gives it.
struct RobotSettings {
  std::string mission;              ///< Its name on the bus (bus::check_mission_name).
  std::vector<std::string> robots;  ///< By number; empty: unknown.
  robot::AgentConfig agent;
  visual::TrackingConfig tracking;
  intake::SensorConfig sensors;  ///< How raw messages that are fed are read.
  bool with_images = false;      ///< Closures are found from images, so images and IMU samples are wanted.
  /// Describes the settings that a mission file may have.
  template <class V>
  void describe(V& v) {
    v.field("agent", agent);
    v.field("tracking", tracking, any(), "How the images that are fed are tracked.");
  }
};

/// The recording that a robot replays.
struct RobotReplay {
  std::shared_ptr<const Recording> recording;  ///< Null: there is none, and samples are fed.
  double start_s = 0.0;                        ///< Mission time of its first sample.
  double duration_s = 0.0;                     ///< The mission's.
  /// Makes an event of an update, whose estimate of the robot's trajectory is `map`. Not set: it is not scored.
  std::function<Json(const Trajectory& map, const robot::RobotAgent& agent)> score;
};

/// How a robot program runs.
struct RobotOptions {
  std::string name;     ///< One of the mission's robots; any name when the robot is fed.
  bus::BusOptions bus;  ///< The mission is that of the settings.
  std::filesystem::path state;
  RobotSettings settings;
  std::string feed;  ///< Path of the Unix socket on which samples are fed; empty: they are from a recording.
  RobotReplay replay;
  FeedAccess feed_access;
  /// Called with the feed of a robot that is fed: starts what feeds it in this process, until the result is destroyed.
  std::function<std::shared_ptr<void>(LiveFeed&)> beside_feed;
  double rate = 1.0;                                          ///< Mission time per wall time.
  double uplink_bytes_per_s = 0.0;                            ///< Per second of mission time, for submaps; 0: no limit.
  std::uint64_t max_archive_bytes = std::uint64_t{1} << 30U;  ///< Size of the archive of submaps that the server has.
  bool stay = false;                                          ///< Go on after the recording, to hear later maps.
  LocaliseSetup localise;                ///< Null: it does not localise in a map from its start on.
  OpenMap open_map;                      ///< It localises in the map that is published last; empty: in none of these.
  bool is_alone = false;                 ///< There is no server: nothing is kept for one.
  std::optional<std::uint64_t> session;  ///< Nothing: the time when the state folder was made.
  Level console = Level::warning;
  std::string version;
};

/// The robot's number: its name's position among the mission's `names`. A robot that is fed and in no mission has a
/// number made from its name, which is the same everywhere and differs from all numbers that missions give. Fails when
/// the name cannot be a robot's, or the mission does not have it.
Result<RobotId> number_of(const std::string& name, const std::vector<std::string>& names, bool is_fed);

/// Replays the robot's recording, or takes what clients feed, from where an earlier program of this state folder
/// stopped. Returns at `stop`; also, unless options.stay, when the recording has ended, the server has stored all
/// submaps, and the robot has heard a map that contains them or has waited 60 s for one.
Status run_robot(const RobotOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::program
