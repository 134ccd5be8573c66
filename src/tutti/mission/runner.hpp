// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/mapfile/hold_map.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/mission/robot_actor.hpp"
#include "tutti/server/closure_verifier.hpp"

namespace tutti::mission {

/// How far a mission is.
struct Progress {
  double time_s = 0.0;  ///< Mission time.
  double duration_s = 0.0;
  std::size_t submaps = 0;
  std::size_t closures = 0;  ///< Accepted ones.
  std::uint32_t components = 0;
};

/// The parts that a mission is run with.
struct MissionParts {
  MissionInput input;
  std::shared_ptr<const server::ClosureVerifier> verifier;
  std::shared_ptr<const server::MapRefiner> refiner;  ///< May be null.
  /// Makes the companions of each robot. Not set, or returning null: there are none.
  std::function<std::unique_ptr<Companions>(const Recording&)> companions;
};

/// How to run a mission.
struct RunOptions {
  std::filesystem::path data;  ///< Folder of the mission's files.
  std::uint64_t seed = 1;
  std::optional<double> rate;  ///< Speed, as a multiple of real time; nothing: as fast as possible.
  int threads = 0;             ///< For verification; 0: all cores. Does not change the result.
  std::string version;         ///< Version of the program, for the report.
  std::string settings_yaml;   ///< Settings to show in the report; empty: those of the configuration.
  std::function<void(const Progress&)> progress;
  /// Called before the mission begins with each of its recordings' warnings, which its record has, too.
  std::function<void(const std::string&)> warn;
  /// Called after every update of the map.
  std::function<void(const server::MapServer&)> updated;
  /// Asked between steps. Once it is true the mission ends as if recordings ended there, with a note on that. Not set:
  /// never.
  std::function<bool()> stop;
  /// The map that the mission's robots extend, in which their numbers are free.
  mapfile::HeldMap map;
  /// Called with the server's store when the mission is over.
  std::function<Status(const storage::TableStore&)> keep_map;
};

/// When the mission ends, in mission seconds.
double duration_of(const MissionConfig& config, const std::vector<MissionRecording>& recordings);

/// Runs a whole mission in virtual time: robots, links, server and feedback, with every message really encoded. The
/// nodes are the ones that programs are made of, with a simulated radio between them, and nobody kills any. The same
/// configuration, data and seed give the same record (except its timing), whatever the number of threads or the rate.
/// Fails when a radio is configured for a robot that the mission does not have, when all scans of a robot fail, or when
/// keep_map does; and when `stop` is true before it began.
Result<MissionRecord> run_mission(const MissionConfig& config, MissionParts parts, const RunOptions& options);
/// The same with the mission's recordings as they are and the configured verifier; also fails when recordings cannot be
/// loaded.
Result<MissionRecord> run_mission(const MissionConfig& config, const RunOptions& options);

}  // namespace tutti::mission
