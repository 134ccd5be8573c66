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
#include "tutti/server/closure_verifier.hpp"

namespace tutti::lab {

/// The mission that a program was started with.
struct MissionSource {
  std::string file;  ///< As load_mission() takes it; empty: none, and every setting has its default.
  std::filesystem::path data;
  std::vector<std::string> assignments;  ///< KEY=VALUE
  std::uint64_t seed = 1;
  std::string name = {};  ///< The mission's name on the bus; empty: the file's.
};

/// Loads the mission; with the defaults of all settings when there is none.
Result<MissionConfig> load(const MissionSource& source);

/// The mission's name on the bus: the one in `source`, else the file's, else the default of programs that get none.
/// Fails when it cannot be a name on a bus.
Result<std::string> name_on_bus(const MissionSource& source, const MissionConfig& config);
/// True if somebody chose that name.
bool is_named(const MissionSource& source);

/// The robots of the mission; a robot's position in the list is its number. Empty when there is no mission.
std::vector<std::string> robot_names(const MissionConfig& config);
/// The mission's closure verifier. Recordings are read only if the verifier needs them.
Result<std::shared_ptr<const server::ClosureVerifier>> make_verifier(const MissionConfig& config,
                                                                     const MissionSource& source);
/// The settings that the mission gives its server and workers.
Result<program::ServerSettings> server_settings(const MissionSource& source);
Result<program::WorkerSettings> worker_settings(const MissionSource& source);
Result<program::RobotSettings> robot_settings(const MissionSource& source);
/// The setup for a robot of the mission to localise in a map's file, as mission::localise_setup() makes it.
Result<std::shared_ptr<const localise::Localiser::Setup>> localise_setup(const MissionSource& source,
                                                                         const std::filesystem::path& map);
/// Sets the settings and the replay of a robot, and reads its recording for that unless the robot is fed
/// (RobotOptions::feed).
Status fill_robot_options(const MissionSource& source, program::RobotOptions& options);

}  // namespace tutti::lab
