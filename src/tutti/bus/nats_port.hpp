// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tutti/base/config.hpp"
#include "tutti/bus/bus_address.hpp"
#include "tutti/bus/port.hpp"

namespace tutti::bus {

struct NatsPortOptions {
  std::string url;
  std::string mission = "tutti";
  bool allow_insecure = false;
  BusCredentials credentials = {};  ///< The one place where they enter; those in a URL count when there are none.
  std::uint64_t max_waiting_bytes = std::uint64_t{64} << 20U;
  std::uint64_t max_held_bytes = std::uint64_t{64} << 20U;
  std::uint64_t max_stream_bytes = std::uint64_t{512} << 20U;
  double stranded_s = 30.0;
  /// Asked before each connection; its error says why not. Empty: always allowed. A server's port asks its
  /// MissionLease.
  std::function<Status()> may_connect = {};
  template <class V>
  void describe(V& v) {
    v.field("url", url, any(), "\"nats://HOST:PORT\"");
    v.field("mission", mission, any(), "Missions on one bus do not hear each other; letters, digits, '-' and '_'.");
    v.field("allow_insecure", allow_insecure, any(), "Connect to other machines without TLS.");
    v.field("max_waiting_bytes", max_waiting_bytes, at_least(0.0),
            "Durable messages and jobs that wait to be sent; then send() refuses.");
    v.field("max_held_bytes", max_held_bytes, at_least(0.0),
            "Messages received and not acknowledged; then the rest stays on the bus.");
    v.field("max_stream_bytes", max_stream_bytes, at_least(0.0),
            "Submaps on the bus; then it takes no more. An eighth each for verdicts, jobs and retained values. The bus "
            "sets that room aside for the mission.");
    v.field("stranded_s", stranded_s, greater_than(0.0),
            "Messages that the bus has and gives to nobody for so long, as after a power failure, are dropped with "
            "their stream, which is made anew: who sent them sends them again. A worker's job that has ended five "
            "workers is removed.");
  }
};

/// State of a port's connection to its bus.
struct NatsState {
  std::string url;
  bool connected = false;  ///< Connected, and subscribed to all that this port receives.
  std::uint64_t reconnects = 0;
  std::size_t waiting_messages = 0;  ///< Parts of messages that are not sent, or not confirmed by the bus.
  std::uint64_t waiting_bytes = 0;
  std::size_t waiting_acknowledgements = 0;
  std::uint64_t refused = 0;            ///< Messages that arrived and could not be understood, or never became whole.
  std::uint64_t streams_made_anew = 0;  ///< Server's port only: streams that the bus had lost, or gave nothing of.
  std::uint64_t jobs_removed = 0;       ///< Server's port only: jobs that no worker gets any more.
  std::uint64_t strange_jobs = 0;       ///< Server's port only: jobs that it has not sent, and has removed.
  /// For how long a connected bus has confirmed nothing of what was sent.
  double unconfirmed_s = 0.0;
  /// What the bus does not let this program do, in the bus's words, since it connected; empty: nothing was refused.
  std::string denied = {};
  /// Server's port only: how often jobs were given to workers since one was last answered, once every job that is out
  /// was given kGivenInVain times on average. 0: jobs are answered.
  std::uint64_t given_in_vain = 0;
  static constexpr std::uint64_t kGivenInVain = 3;
  std::string last_error = {};
};

/// A port over NATS JetStream (docs/bus.md). The server's port makes the streams that the mission needs on the bus and
/// keeps those that exist. Threads of its own connect, send, receive and acknowledge. What the bus has not confirmed is
/// sent again with the same id, of which the bus stores one. Sent first are status messages, then retained ones, then
/// the rest in the order of send(), of submaps the newest. Without a bus the port waits for one. The destructor takes
/// seconds at most, in which acknowledgements are delivered if the bus can be reached.
class NatsPort : public Port {
 public:
  [[nodiscard]] virtual NatsState state() const = 0;
};

/// Opens the endpoint's port without waiting for the bus. Errors are those of the options.
Result<std::unique_ptr<NatsPort>> open_nats_port(Endpoint endpoint, const NatsPortOptions& options);

}  // namespace tutti::bus
