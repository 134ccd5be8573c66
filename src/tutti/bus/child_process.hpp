// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace tutti::bus {

struct ChildCommand {
  std::vector<std::string> words;     ///< The program, which is searched for in PATH, and its arguments.
  std::string elsewhere = {};         ///< Where the program is when PATH does not have it; empty: nowhere.
  int output = -1;                    ///< A file for its output and errors; -1: this program's.
  int inherits = -1;                  ///< An open file that it gets, too; -1: none.
  bool has_our_variables = false;     ///< False: no TUTTI_.. of this program's environment, which may be secrets.
  std::uint64_t most_data_bytes = 0;  ///< Memory beyond which it gets none; 0: no limit.
  /// On a machine without memory the kernel ends it before others, and where cores are few others come before it.
  bool goes_first = false;
};

/// A child process. It ends with this process, however this one ends: the kernel ends it with the thread that forked
/// it, which waits for its end. Ctrl-C at a terminal does not reach it.
class ChildProcess {
 public:
  /// Returns when the program has begun, or could not be started (failure()).
  explicit ChildProcess(ChildCommand command);
  /// Stops it, by SIGINT and after 3 s by SIGKILL.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  [[nodiscard]] int failure() const;  ///< errno of what did not let it start; 0: it did.
  [[nodiscard]] bool ended() const;
  /// The exit code; nothing: it runs, or a signal ended it.
  [[nodiscard]] std::optional<int> exit_code() const;
  [[nodiscard]] int pid() const;
  /// Ends it at once.
  void kill();

 private:
  void run(ChildCommand& command);
  void report(pid_t child, int failure);

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  pid_t pid_ = -1;
  int failure_ = 0;
  bool ended_ = false;
  std::optional<int> exit_code_;
  std::thread thread_;
};

}  // namespace tutti::bus
