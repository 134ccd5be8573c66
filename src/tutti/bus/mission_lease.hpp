// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "tutti/bus/lease_holder.hpp"
#include "tutti/bus/transport.hpp"

namespace tutti::bus {

/// How leases are kept, in seconds.
struct LeaseTimes {
  double lease_s = 30.0;      ///< The bus drops a lease so long after it was renewed.
  double renew_s = 3.0;       ///< A holder renews its lease.
  double unrenewed_s = 10.0;  ///< A lease that was not renewed for so long is that of a server that has ended.
  double look_s = 10.0;       ///< A program that only reads does so, until its mission has a server;
  double rest_s = 300.0;      ///< then it pauses.
};

/// Knows which missions are served on a bus and by whom, and ensures that a mission has one server. A server's lease is
/// a value on the bus that the server renews; the bus drops it in the end, and the server itself when it ends in order.
/// Only a lease that is renewed counts against a server: a value that is no lease is overwritten; the lease of an
/// earlier start on the same seat is taken over, at once if that process has certainly ended, otherwise when it was not
/// renewed for LeaseTimes::unrenewed_s; and a holder in whose place another lease stands goes on, and takes its own
/// back when that one is not renewed. A thread of its own talks to the bus; all functions may be called by any thread.
class MissionLease {
 public:
  /// With `self`, takes and renews the lease of where.mission for it. Without, only reads. Does not wait for the bus;
  /// errors are those of the options.
  static Result<std::unique_ptr<MissionLease>> open(const BusOptions& where, std::optional<LeaseHolder> self,
                                                    const LeaseTimes& times = {});
  ~MissionLease();
  MissionLease(const MissionLease&) = delete;
  MissionLease& operator=(const MissionLease&) = delete;

  struct State {
    bool has_looked = false;                      ///< The bus has been looked at, at least once.
    bool held = false;                            ///< The lease was held by `self` at the last check.
    std::string waits;                            ///< Why it is not known yet who has it; empty when it is.
    std::map<std::string, LeaseHolder> missions;  ///< By mission. The own mission alone, if somebody else serves it;
                                                  ///< otherwise, without `self`, all missions that are served.
    std::string last_error;

    [[nodiscard]] const LeaseHolder* server_of(const std::string& mission) const {
      const auto found = missions.find(mission);
      return found == missions.end() ? nullptr : &found->second;
    }
  };
  [[nodiscard]] State state() const;
  /// state(), as soon as the bus has been looked at and it is known who has the lease, or after `wall_s` at the latest.
  [[nodiscard]] State wait(double wall_s) const;
  /// An error while `self` does not hold the lease, with the reason: the bus cannot be reached or refuses, or who has
  /// it.
  [[nodiscard]] Status check_held() const;
  /// For people, why no server is heard: this mission has none on the bus, but others have. Empty when that is not so.
  [[nodiscard]] std::string why_alone() const;

 private:
  using Clock = std::chrono::steady_clock;
  MissionLease(const Transport& transport, BusOptions where, std::optional<LeaseHolder> self, const LeaseTimes& times);
  void run();
  /// Takes or renews the lease, or reads the others'.
  Status check_board(LeaseBoard& board);
  /// Whether the lease is to be written; otherwise state_ knows who has it.
  bool may_take(const std::optional<LeaseHolder>& there, std::uint64_t revision);
  void give_up(LeaseBoard& board) const;

  const Transport& transport_;
  const BusOptions where_;
  const std::optional<LeaseHolder> self_;  // as it reads on the bus
  const LeaseTimes times_;
  // Only the thread uses it: what another holder has in the place of the own lease, and since when.
  struct Other {
    LeaseHolder holder;
    std::uint64_t revision = 0;
    Clock::time_point since;
    bool is_renewed = false;
  };
  std::optional<Other> other_;
  std::optional<Clock::time_point> written_;  // the own lease
  mutable std::mutex mutex_;                  // guards what follows
  mutable std::condition_variable changed_;
  State state_;
  bool stopping_ = false;
  std::thread thread_;
};

/// How long programs wait for a server before they give up: a bus that has lost its disk has no leases until its
/// servers have reconnected and renewed theirs (LeaseTimes::renew_s).
inline constexpr double kLookForServer_s = 10.0;

/// where.mission, or when that is empty that of its credential, if it has one of `tutti pki`, or the mission that is
/// served on the bus. Waits at most `wall_s` for a lease;
/// then, and when kDefaultMission is among several served ones, it is that. An error when several other missions are
/// served. `say`, if given, gets once what is waited for, when that takes long.
Result<std::string> served_mission(const BusOptions& where, double wall_s,
                                   const std::function<void(const std::string&)>& say = {});

}  // namespace tutti::bus
