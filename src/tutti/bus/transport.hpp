// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/bus_address.hpp"
#include "tutti/bus/lease_board.hpp"
#include "tutti/bus/map_board.hpp"
#include "tutti/bus/port.hpp"

namespace tutti::bus {

inline constexpr const char* kDefaultMission = "tutti";

/// How a program joins a bus.
struct BusOptions {
  std::string url;                        ///< Its scheme chooses the transport.
  std::string mission = kDefaultMission;  ///< Missions on one bus do not hear each other (check_mission_name()).
  bool allow_insecure = false;            ///< Connect to other machines without TLS.
  BusCredentials credentials = {};        ///< The one place where they enter; those in a URL count when there are none.
  /// Durable messages and jobs that wait to be sent; then send() refuses.
  std::uint64_t max_waiting_bytes = std::uint64_t{64} << 20U;
  /// Messages received and not acknowledged; then the rest stays on the bus.
  std::uint64_t max_held_bytes = std::uint64_t{64} << 20U;
  /// Submaps on the bus, which sets that room aside for the mission; then it takes no more. Half of it for published
  /// maps, and an eighth each for verdicts, jobs and retained values.
  std::uint64_t max_stream_bytes = std::uint64_t{512} << 20U;
  /// Messages that the bus has and gives to nobody for so long, as after a power failure, are dropped with their
  /// stream, which is made anew: who sent them sends them again. A worker's job that has ended five workers is removed.
  double stranded_s = 30.0;
  /// Asked before each connection; its error states why not. Empty: always allowed. A server's port asks its
  /// MissionLease.
  std::function<Status()> may_connect = {};
};

/// A kind of bus. To be added as a row of transports().
struct Transport {
  std::string_view scheme;   ///< Its URLs'.
  std::string_view example;  ///< A URL of this kind.
  std::string_view help;     ///< One phrase for people.
  /// Why these options cannot be; may be null. Mission and URL have been checked.
  Status (*check)(const BusOptions& options, const BusUrl& url);
  /// Neither waits for the bus.
  std::unique_ptr<Port> (*open_port)(Endpoint endpoint, const BusOptions& options);
  std::unique_ptr<LeaseBoard> (*open_leases)(const BusOptions& options);
  std::unique_ptr<MapBoard> (*open_maps)(const BusOptions& options);
};
const std::vector<Transport>& transports();
/// "nats://HOST:PORT (a nats-server), ..", for help texts.
std::string transports_help();

/// 1 to 32 letters, digits, '-' and '_'; the error states that.
Status check_mission_name(const std::string& name);
/// The transport of these options, which are checked.
Result<const Transport*> transport_of(const BusOptions& options);
/// Opens the endpoint's port without waiting for the bus. Errors are those of the options.
Result<std::unique_ptr<Port>> open_port(Endpoint endpoint, const BusOptions& options);
/// Opens the mission's published maps, likewise.
Result<std::unique_ptr<MapBoard>> open_maps(const BusOptions& options);

}  // namespace tutti::bus
