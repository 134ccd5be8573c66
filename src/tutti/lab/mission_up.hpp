// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/mission/record.hpp"

namespace tutti::lab {

/// The mission to run, and where and how to run it.
struct MissionUpOptions {
  std::filesystem::path program;  ///< The program `tutti` itself.
  MissionSource mission;
  std::filesystem::path out;  ///< State and output of the programs go to OUT/state, which must not exist yet.
  double rate = 1.0;
  int workers = 0;          ///< 0: the server verifies closures itself.
  int threads = 1;          ///< The server's, without workers, and each worker's.
  std::string view;         ///< Where the server serves its page ("[HOST:]PORT"); empty: nowhere.
  bool has_rights = false;  ///< With TLS and a credential for each program, made by `tutti pki` in OUT/state/pki.
  std::string version;
  std::function<void(const std::string&)> progress;  ///< Called with one line, about twice a second.
};

/// Runs a whole mission as programs on this machine: a server with its own bus, a program for each robot, and workers.
/// Returns when all robots have replayed their recordings, the server has mapped everything, and every robot has
/// received the last map. Fails when a program ends earlier (with its output). At `stop`
/// the record is of what is there, with a note.
Result<mission::MissionRecord> mission_up(const MissionUpOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::lab
