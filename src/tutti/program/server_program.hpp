// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/finder_settings.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::program {

inline constexpr const char* kMapFile = "map.tutti";       ///< In a server's state folder.
inline constexpr const char* kStatusFile = "status.json";  ///< In both: Hosted::status() of the last half second.

/// What a server is told of its mission.
struct ServerSettings {
  std::string mission;                            ///< Its name on the bus (bus::check_mission_name).
  std::vector<std::string> robots;                ///< By their number; empty: nobody has told, and any is welcome.
  bool accepts_others = true;                     ///< Robots that are none of these, from their first submap on.
  std::string robot_arguments = "--feed SOCKET";  ///< The last ones of the command that starts a robot.
  server::ServerConfig server;
  FinderSettings finders;
  /// Of these, what a mission file may say.
  template <class V>
  void describe(V& v) {
    v.field("server", server);
    finders.describe(v);
  }
};

struct ServerOptions {
  std::filesystem::path state;
  std::string bus;     ///< "nats://HOST:PORT"; empty: a nats-server of its own,
  std::string listen;  ///< at this "HOST" or "HOST:PORT"; empty: this machine only, any free port.
  bool insecure = false;
  ServerSettings settings;
  int threads = 1;  ///< That verify closures here; 0: workers do.
  double rate = 1.0;
  Level console = Level::warning;
  std::string version;
  /// Called once, with the command that starts a robot of this server.
  std::function<void(const std::string&)> announce;
};

/// Until `stop`. Errors of kind configuration are of the options.
Status run_server(const ServerOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::program
