// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "tutti/bus/port.hpp"

namespace tutti::bus {

/// Messages between the ports of one mission, in memory: those that are not acknowledged, which outlive the ports, and
/// the retained values. An endpoint without a port receives nothing; when it connects again retained values are sent to
/// it. One thread at a time.
class Broker {
 public:
  /// Returns the retained values that the endpoint is to get now. It must have no port.
  [[nodiscard]] std::vector<Envelope> connect(Endpoint endpoint);
  [[nodiscard]] bool has_port(Endpoint endpoint) const { return connected_.contains(endpoint); }
  void disconnect(Endpoint endpoint);
  /// Keeps a retained value for receivers that come later. To be called before arrive().
  void retain(const Envelope& envelope);
  /// The message is at its receivers.
  void arrive(Envelope envelope);
  [[nodiscard]] std::vector<Received> receive(Endpoint endpoint);
  void acknowledge(std::uint64_t ticket) { messages_.erase(ticket); }
  /// Bytes of this sender's messages that are not acknowledged.
  [[nodiscard]] std::uint64_t bytes_of(Endpoint from) const;
  /// Whether a message of this sender, kind and id waits to be received for the first time.
  [[nodiscard]] bool is_waiting(const Envelope& envelope) const;

 private:
  struct Message {
    Envelope envelope;
    bool given = false;  ///< Whether the receiver's present port has returned it from receive(); for a job the receiver
                         ///< is then `envelope.to`.
  };
  void put(Envelope envelope);

  std::set<Endpoint> connected_;
  std::uint64_t next_ticket_ = 0;
  std::map<std::uint64_t, Message> messages_;  ///< By ticket: messages that are not acknowledged.
  std::map<std::pair<Endpoint, MessageKind>, Envelope> retained_;
};

}  // namespace tutti::bus
