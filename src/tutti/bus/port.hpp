// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/envelope.hpp"

namespace tutti::bus {

/// A message that has arrived, and the ticket that acknowledge() takes for it. A port never gives a ticket twice.
struct Received {
  Envelope envelope;
  std::uint64_t ticket = 0;
};

/// Connects one endpoint to the others; an endpoint has one port at a time. bus/delivery.hpp says what is guaranteed
/// for each kind of message. A port is used by one thread. port_conformance_test.cpp holds every implementation to this
/// contract.
class Port {
 public:
  /// A message that was received and not acknowledged comes again at once to the next port of this endpoint, a job to
  /// any worker. A message that was sent and has not left yet may be lost; whoever needs it sends it again after a
  /// start.
  virtual ~Port() = default;
  /// Takes a message, which leaves when it can; never waits for the network. `envelope.from` is this endpoint. A
  /// retained message takes the place of the last one to the same receiver. Any other message with the kind and id of
  /// one that has not left yet changes nothing. On an error the message was not taken, because too many wait, and must
  /// be sent again later.
  [[nodiscard]] virtual Status send(Envelope envelope) = 0;
  /// Returns what has come, without waiting. A worker gets one job at a time: the next one comes when the last is
  /// acknowledged. A job that has ended every worker that had it may come back to the server, from any_worker(), and
  /// then nobody gets it any more.
  [[nodiscard]] virtual std::vector<Received> receive() = 0;
  /// Says that the receiver has done, and stored, all that the message asks for, so that it does not come again. Not
  /// needed, but allowed, for messages that are retained or best effort. A worker stores nothing: its acknowledgement
  /// leaves after all that it has sent before.
  virtual void acknowledge(std::uint64_t ticket) = 0;
  /// Says that work on this message goes on. If a worker does not call this every few seconds during
  /// a long job, another worker gets the job, too.
  virtual void still_busy(std::uint64_t ticket) = 0;
};

}  // namespace tutti::bus
