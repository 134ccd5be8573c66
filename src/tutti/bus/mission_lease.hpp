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

/// Who serves a mission.
struct LeaseHolder {
  std::string host;
  std::uint64_t process = 0;
  std::string state;          ///< Its folder.
  std::int64_t since_ns = 0;  ///< Wall time since the Unix epoch.
  /// Of its state folder on this machine, since it was last started: who comes with the same one is its successor, for
  /// a folder is open in one program at a time.
  std::string seat;
  friend bool operator==(const LeaseHolder&, const LeaseHolder&) = default;
};
/// "process 17 on base, state /var/lib/tutti-server, since 2026-01-31 12:00:00 UTC".
std::string to_string(const LeaseHolder& holder);

/// 1 to 32 letters, digits, '-' and '_'; the error says so.
Status check_mission_name(const std::string& name);

/// Which missions are served on a bus, and by whom; and that each is by one server only. A server's lease is a value of
/// the bus that it renews, and that is gone kLease_s after the last time; or at once, when it ends in order. A thread
/// of its own talks to the bus.
class MissionLease {
 public:
  static constexpr double kLease_s = 30.0;
  static constexpr double kRenew_s = 3.0;
  static constexpr double kLook_s = 10.0;
  static constexpr double kRest_s = 300.0;  ///< Of who only looks, when there is one.

  /// Without `self` it only looks, every `look_s` until there is a server of its mission. Errors are of the options.
  static Result<std::unique_ptr<MissionLease>> open(const NatsPortOptions& where, std::optional<LeaseHolder> self,
                                                    double look_s = kLook_s);
  ~MissionLease();
  MissionLease(const MissionLease&) = delete;
  MissionLease& operator=(const MissionLease&) = delete;

  struct State {
    bool has_looked = false;                      ///< At the bus, at least once.
    bool held = false;                            ///< By `self`, when last looked.
    std::map<std::string, LeaseHolder> missions;  ///< The own one, of another holder; or, without a server, all others.
    std::string last_error;

    [[nodiscard]] const LeaseHolder* server_of(const std::string& mission) const {
      const auto found = missions.find(mission);
      return found == missions.end() ? nullptr : &found->second;
    }
  };
  [[nodiscard]] State state() const;
  /// That, as soon as the bus has been looked at, at most after so long.
  [[nodiscard]] State wait(double wall_s) const;
  /// Why nobody is heard, for people: the mission has no server here, but others have. Empty: no such thing.
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

/// A bus that has lost its disk has no leases until servers have renewed theirs (MissionLease::kRenew_s, after they
/// have connected again).
inline constexpr double kLookForServer_s = 10.0;

/// The one mission that is served on a bus, as soon as there is one: for who was told none. After so long it is what
/// programs call theirs that are told no other (NatsPortOptions): an older server has no lease. An error: there are
/// several.
Result<std::string> served_mission(const NatsPortOptions& where, double wall_s);

}  // namespace tutti::bus
