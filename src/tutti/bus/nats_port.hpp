// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "tutti/base/config.hpp"
#include "tutti/bus/port.hpp"

namespace tutti::bus {

struct NatsPortOptions {
  std::string url;
  std::string mission = "tutti";
  bool allow_insecure = false;
  std::uint64_t max_waiting_bytes = std::uint64_t{64} << 20U;
  std::uint64_t max_held_bytes = std::uint64_t{64} << 20U;
  std::uint64_t max_stream_bytes = std::uint64_t{512} << 20U;
  double stranded_s = 30.0;
  std::function<bool()> may_connect = {};  ///< Asked before each connection; none: always. See MissionLease.
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

/// How a port stands with its bus.
struct NatsState {
  std::string url;
  bool connected = false;  ///< And listening.
  std::uint64_t reconnects = 0;
  std::size_t waiting_messages = 0;  ///< Their parts: not sent, or not confirmed by the bus.
  std::uint64_t waiting_bytes = 0;
  std::size_t waiting_acknowledgements = 0;
  std::uint64_t refused = 0;            ///< Arrived, and were none of ours, or never whole.
  std::uint64_t streams_made_anew = 0;  ///< Of the server's port: the bus had lost them, or gave nothing of them.
  std::uint64_t jobs_removed = 0;       ///< Of the server's port: those that no worker gets any more.
  /// So long the bus, which is there, has stored nothing of what was sent.
  double unconfirmed_s = 0.0;
  std::string last_error;
};

/// A port over NATS JetStream. The server's makes what the mission needs on the bus, and leaves what is there. A thread
/// of its own connects, sends and acknowledges, and sends again what the bus has not confirmed, with the same id: the
/// bus stores each once. What is sent first: status, retained, then the rest in the order of send(), of submaps the
/// newest. Without a bus it waits for one. Ends within seconds, after what was acknowledged is so on the bus, if that
/// can be reached.
class NatsPort : public Port {
 public:
  [[nodiscard]] virtual NatsState state() const = 0;
};

/// Does not wait for the bus. Errors are of the options.
Result<std::unique_ptr<NatsPort>> open_nats_port(Endpoint endpoint, const NatsPortOptions& options);

}  // namespace tutti::bus
