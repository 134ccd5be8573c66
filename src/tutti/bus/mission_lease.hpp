// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tutti/bus/nats_port.hpp"

namespace tutti::bus {

class NatsConnection;

/// The server that serves a mission.
struct LeaseHolder {
  std::string host;
  std::uint64_t process = 0;
  std::string state;          ///< Its state folder.
  std::int64_t since_ns = 0;  ///< Wall time since the Unix epoch.
  /// Names state folder and boot of the machine. A server with the same seat is the successor of one that was killed,
  /// because a state folder is open in one program at a time.
  std::string seat;
  friend bool operator==(const LeaseHolder&, const LeaseHolder&) = default;
};
/// "process 17 on base, state /var/lib/tutti-server, since 2026-01-31 12:00:00 UTC".
std::string to_string(const LeaseHolder& holder);

/// 1 to 32 letters, digits, '-' and '_'; the error says so.
Status check_mission_name(const std::string& name);

/// Knows which missions are served on a bus and by whom, and ensures that a mission has one server. A server's lease is
/// a value on the bus that the server renews every kRenew_s; the bus drops it kLease_s after the last renewal, and the
/// server itself when it ends in order. A thread of its own talks to the bus; all functions may be called by any
/// thread.
class MissionLease {
 public:
  static constexpr double kLease_s = 30.0;
  static constexpr double kRenew_s = 3.0;
  static constexpr double kLook_s = 10.0;
  static constexpr double kRest_s = 300.0;  ///< Pause of a program that only looks, once its mission has a server.

  /// With `self`, takes and renews the lease of where.mission for it. Without, only looks, every `look_s` until that
  /// mission has a server, then every kRest_s. Does not wait for the bus; errors are those of the options.
  static Result<std::unique_ptr<MissionLease>> open(const NatsPortOptions& where, std::optional<LeaseHolder> self,
                                                    double look_s = kLook_s);
  ~MissionLease();
  MissionLease(const MissionLease&) = delete;
  MissionLease& operator=(const MissionLease&) = delete;

  struct State {
    bool has_looked = false;                      ///< The bus has been looked at, at least once.
    bool held = false;                            ///< The lease was held by `self` at the last look.
    std::map<std::string, LeaseHolder> missions;  ///< By mission. The own mission alone, if somebody else serves it;
                                                  ///< otherwise, without `self`, all missions that are served.
    std::string last_error;

    [[nodiscard]] const LeaseHolder* server_of(const std::string& mission) const {
      const auto found = missions.find(mission);
      return found == missions.end() ? nullptr : &found->second;
    }
  };
  [[nodiscard]] State state() const;
  /// state(), as soon as the bus has been looked at, or after `wall_s` at the latest.
  [[nodiscard]] State wait(double wall_s) const;
  /// For people, why no server is heard: this mission has none on the bus, but others have. Empty when that is not so.
  [[nodiscard]] std::string why_alone() const;

 private:
  MissionLease(NatsPortOptions where, std::optional<LeaseHolder> self, double look_s);
  void run();
  Status look(const NatsConnection& connection);
  void give_up(const NatsConnection& connection) const;

  const NatsPortOptions where_;
  const std::optional<LeaseHolder> self_;
  const double look_s_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::condition_variable changed_;
  State state_;
  bool stopping_ = false;
  std::thread thread_;
};

/// How long programs look for a server before they give up: a bus that has lost its disk has no leases until its
/// servers have reconnected and renewed theirs (MissionLease::kRenew_s).
inline constexpr double kLookForServer_s = 10.0;

/// The mission that is served on a bus, for a program that was not told which to join. Waits at most `wall_s` for a
/// lease; then, and when where.mission is among several served ones, it is where.mission, because servers of older
/// versions have no lease. An error when several other missions are served.
Result<std::string> served_mission(const NatsPortOptions& where, double wall_s);

}  // namespace tutti::bus
