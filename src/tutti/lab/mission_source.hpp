// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/program/robot_program.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/program/worker_program.hpp"
#include "tutti/server/closure_finder.hpp"

namespace tutti::lab {

/// What a program is told of its mission.
struct MissionSource {
  std::string file;  ///< MISSION.yaml; "demo": the built-in one; empty: none, and every setting has its default.
  std::filesystem::path data;
  std::vector<std::string> assignments;  ///< KEY=VALUE
  std::uint64_t seed = 1;
  std::string name = {};  ///< That the mission is to have on the bus; empty: the file's.
};

Result<MissionConfig> load(const MissionSource& source);

/// What the mission is called on the bus: as the program was told, else as the file says, else as all are that are told
/// nothing. An error: no name for a bus.
Result<std::string> name_on_bus(const MissionSource& source, const MissionConfig& config);
/// Whether that was chosen by anybody.
bool is_named(const MissionSource& source);

/// The robots of the mission by their place in it, which is their number; empty when there is no mission.
std::vector<std::string> robot_names(const MissionConfig& config);
/// Reads the recordings only if the finder needs them.
Result<std::shared_ptr<const server::ClosureFinder>> make_finder(const MissionConfig& config,
                                                                 const MissionSource& source);
/// What the programs of the mission are told of it.
Result<program::ServerSettings> server_settings(const MissionSource& source);
Result<program::WorkerSettings> worker_settings(const MissionSource& source);
/// And, unless it is fed (RobotOptions::feed), its recording, read here: sets settings, replay and duration_s.
Status tell_robot(const MissionSource& source, program::RobotOptions& options);

}  // namespace tutti::lab
