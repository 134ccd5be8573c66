// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/bus_credentials.hpp"
#include "tutti/bus/child_process.hpp"
#include "tutti/bus/nats_log.hpp"

namespace tutti::bus {

struct NatsChildOptions {
  std::string program = "nats-server";  ///< Searched for in PATH, then in /usr/sbin.
  std::string host = "127.0.0.1";
  int port = 0;                 ///< 0: the port of the last time if that is free, else any from 20000 on.
  bool allow_insecure = false;  ///< Listen at other addresses than this machine's own, without TLS.
  /// The blocks `tls`, `authorization` and `accounts` of nats-server's configuration (pki::Pki::bus_configuration()),
  /// and the server's own credential; empty: whoever reaches the bus may do all.
  std::string rights = {};
  BusCredentials credentials = {};
  std::uint64_t max_store_bytes = std::uint64_t{4} << 30U;  ///< Space for messages on the disk.
  /// Beside max_store_bytes, this must be free on the disk: nats-server hangs on a full one.
  std::uint64_t min_free_bytes = std::uint64_t{1} << 30U;
  double start_timeout_s = 30.0;  ///< It must be ready by then.
};

/// A nats-server with JetStream as a child process. The child ends with this process, however this one ends. Its folder
/// has its configuration, messages and log, and is locked, so that one nats-server has it at a time.
class NatsChild {
 public:
  /// Returns when the child takes messages. Makes the folder if it is missing. Errors: not installed, the port is
  /// taken, another nats-server has the folder, too little disk, or what the child's log reports.
  static Result<std::unique_ptr<NatsChild>> start(const std::filesystem::path& folder,
                                                  const NatsChildOptions& options = {});
  /// Stops the child, by SIGINT and after 3 s by SIGKILL.
  ~NatsChild();
  NatsChild(const NatsChild&) = delete;
  NatsChild& operator=(const NatsChild&) = delete;

  [[nodiscard]] const std::string& url() const { return url_; }  ///< "nats://127.0.0.1:40123", with rights "tls://.."
  [[nodiscard]] int pid() const { return pid_; }
  [[nodiscard]] bool running() const;
  /// To be called about once a second: starts a child that has ended again, at the same address, stops it for as
  /// long as less than half of min_free_bytes are free, and gives it its rights when they have changed, which cuts off
  /// those who have none any more. An error states why it is not running now, or has not got its rights.
  Status tend();
  /// From the next tend() on.
  void set_rights(std::string rights) { options_.rights = std::move(rights); }
  /// Its refusals since this was last called, at most kMostRefusals, and how many more.
  struct Refusals {
    std::vector<BusRefusal> all;
    std::uint64_t more = 0;
  };
  static constexpr std::size_t kMostRefusals = 1000;
  [[nodiscard]] Refusals take_refusals();

 private:
  NatsChild(std::filesystem::path folder, NatsChildOptions options);
  Status lock_folder();
  Status launch(int port);
  Status launch_anywhere();
  [[nodiscard]] Status check_disk(std::uint64_t needed) const;
  [[nodiscard]] Status wait_until_ready();
  /// Writes its configuration. True: it is another than before.
  Result<bool> configure(int port);
  /// Who was refused, and whether it has read its configuration.
  void read_log();

  std::filesystem::path folder_;
  NatsChildOptions options_;
  int lock_ = -1;  ///< The lock file, open and locked; the child inherits it and holds the lock until it ends.
  std::unique_ptr<ChildProcess> process_;
  std::string configured_;    ///< Its configuration, without nobody's certificate.
  bool has_nobody_ = false;   ///< The one that was written has it.
  bool reads_again_ = false;  ///< It is to be written once more.
  /// When it was sent the signal to read its configuration; nothing: its log says that it has.
  std::optional<std::chrono::steady_clock::time_point> signalled_;
  std::uintmax_t log_read_ = 0;  ///< So much of its log.
  Refusals refusals_;            ///< Refusals there that were not taken yet.
  std::string url_;
  int pid_ = -1;
};

/// Where the buses listen that this user's or root's servers run on this machine, found by their nats-servers' command
/// lines in /proc; sorted. Those of other users are left out, as anybody can call a program nats-server.
std::vector<std::string> buses_of_this_machine();

}  // namespace tutti::bus
