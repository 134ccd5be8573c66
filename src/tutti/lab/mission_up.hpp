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

struct MissionUpOptions {
  std::filesystem::path program;  ///< tutti itself.
  MissionSource mission;
  std::filesystem::path out;  ///< The programs' state and output go to OUT/state, which must not be there yet.
  double rate = 1.0;
  int workers = 0;  ///< 0: the server verifies closures itself,
  int threads = 1;  ///< on so many threads; each worker has as many.
  std::string version;
  std::function<void(const std::string&)> progress;  ///< One line, about twice a second.
};

/// A whole mission as programs of this machine: a server with a bus of its own, a robot for each of the mission, and
/// workers. Ends when all robots have replayed their recordings, the server has mapped everything, and every robot has
/// heard the last map. An error: a program has ended before, with what it said; or `stop`.
Result<mission::MissionRecord> mission_up(const MissionUpOptions& options, const std::atomic<bool>& stop);

}  // namespace tutti::lab
