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

#include "tutti/base/result.hpp"
#include "tutti/bus/transport.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/map_viewer.hpp"
#include "tutti/program/page_child.hpp"
#include "tutti/program/verifier_settings.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::program {

inline constexpr const char* kMapFile = "map.tutti";  ///< In a server's state folder.
/// In a server's: what it has computed of its map last (mapfile/estimate_file.hpp).
inline constexpr const char* kEstimateFile = "estimate";
/// In a server's and in a robot's: Hosted::status(), at most half a second old.
inline constexpr const char* kStatusFile = "status.json";

/// A server's mission, as its command line gives it.
struct ServerSettings {
  std::string mission;                            ///< Its name on the bus (bus::check_mission_name).
  std::vector<std::string> robots;                ///< By number; empty: unknown, and every robot is welcome.
  bool accepts_others = true;                     ///< Other robots join with their first submap.
  std::string robot_arguments = "--feed SOCKET";  ///< The last arguments of the command that starts a robot.
  server::ServerConfig server;
  VerifierSettings verifiers;
  /// Describes the settings that a mission file may have.
  template <class V>
  void describe(V& v) {
    v.field("server", server);
    verifiers.describe(v);
  }
};

/// How a server program runs.
struct ServerOptions {
  std::filesystem::path state;
  std::filesystem::path held_map;  ///< A map's file; where STATE has no map, it begins with this one, which is held.
  bus::BusOptions bus;        ///< The mission is that of the settings. No URL: the program starts its own nats-server,
  std::string listen;         ///< at this "HOST" or "HOST:PORT"; empty: on this machine only, at any free port.
  std::filesystem::path pki;  ///< Folder of `tutti pki`, for its own nats-server; empty: whoever reaches it may do all.
  ServerSettings settings;
  int threads = 1;    ///< Threads that verify closures in this program; 0: workers do it.
  double rate = 1.0;  ///< Mission time per wall time.
  Level console = Level::warning;
  std::string version;
  /// Each makes a viewer of the map, whose store outlives it.
  std::vector<std::function<Result<std::unique_ptr<MapViewer>>(const storage::TableStore& map)>> views;
  std::optional<PageChildOptions> page;  ///< The page of the mission, as a program of its own.
  /// Called once with the command that starts a robot of this server.
  std::function<void(const std::string&)> announce;
};

/// Runs a server until `stop`. Errors of kind configuration are about the options.
Status run_server(const ServerOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::program
