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
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/mission/robot_actor.hpp"
#include "tutti/server/closure_finder.hpp"
#include "tutti/storage/table_store.hpp"

namespace tutti::mission {

struct Progress {
  double time_s = 0.0;  ///< Mission time.
  double duration_s = 0.0;
  std::size_t submaps = 0;
  std::size_t closures = 0;  ///< Accepted.
  std::uint32_t components = 0;
};

/// What a mission is run with.
struct MissionParts {
  MissionInput input;
  std::shared_ptr<const server::ClosureFinder> finder;
  std::shared_ptr<const server::MapRefiner> refiner;  ///< May be null.
  /// Those of each robot, made with its agent's randomness; null, or of null: none.
  std::function<std::unique_ptr<Companions>(const Recording&, const Rng&)> companions;
};

struct RunOptions {
  std::filesystem::path data;  ///< Folder the mission's files lie in.
  std::uint64_t seed = 1;
  std::optional<double> rate;  ///< Times real time; none = as fast as possible.
  int threads = 0;             ///< For verifications; 0 = all cores. Does not change the result.
  std::string version;         ///< Of the program, for the report.
  std::string settings_yaml;   ///< That the report is to show; empty: those of the configuration.
  std::function<void(const Progress&)> progress;
  /// Is given what the server has stored, once the mission is over.
  std::function<Status(const storage::TableStore&)> keep_map;
};

/// What a robot's agent draws from.
Rng agent_randomness(std::uint64_t seed, const std::string& robot);
/// When the mission ends, in mission seconds.
double duration_of(const MissionConfig& config, const std::vector<MissionRecording>& recordings);

/// Runs a whole mission in virtual time: robots, links, server and feedback, every message through its real encoding.
/// The very nodes that programs are made of, a simulated radio between them, and nobody who kills any.
/// The same configuration, data and seed give the same record (except its timing), whatever the threads or the rate.
Result<MissionRecord> run_mission(const MissionConfig& config, MissionParts parts, const RunOptions& options);
/// Of recordings as they are, with the finder of the configuration.
Result<MissionRecord> run_mission(const MissionConfig& config, const RunOptions& options);

}  // namespace tutti::mission
