// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/program/event_log.hpp"
#include "tutti/program/mission_source.hpp"

namespace tutti::program {

inline constexpr const char* kMapFile = "map.tutti";       ///< In a server's state folder.
inline constexpr const char* kStatusFile = "status.json";  ///< In both: Hosted::status() of the last half second.

struct ServerOptions {
  std::filesystem::path state;
  std::string bus;     ///< "nats://HOST:PORT"; empty: a nats-server of its own,
  std::string listen;  ///< at this "HOST" or "HOST:PORT"; empty: this machine only, any free port.
  bool insecure = false;
  MissionSource mission;
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
