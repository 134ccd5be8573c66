// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/envelope.hpp"

namespace tutti::bus {

/// What has arrived, and its number for acknowledge(): of the port that gave it, never used twice by it.
struct Received {
  Envelope envelope;
  std::uint64_t ticket = 0;
};

/// One endpoint's way to the others: its only one, from when it starts until it ends. bus/delivery.hpp says what is
/// owed to which kind of message. To be used by one thread. port_conformance_test.cpp holds every
/// implementation to this contract.
class Port {
 public:
  /// What was received and not acknowledged comes again, to the next port of this endpoint at once (a job: to any
  /// worker). What was sent and has not left yet may be lost: whoever needs it sends it again when it starts again.
  virtual ~Port() = default;
  /// Never waits for the network: the message leaves when it can. `envelope.from` is this endpoint. A retained message
  /// takes the place of the last one to the same receiver; another one with the kind and id of one that has not left
  /// yet changes nothing. An error: it was not taken (as when too many wait), and is
  /// to be sent again later.
  [[nodiscard]] virtual Status send(Envelope envelope) = 0;
  /// What has come, without waiting, each once for every time that it is owed. Of jobs one at a time: the next when the
  /// last one is acknowledged. A job that has ended every worker that had it may come back to the server, from
  /// any_worker(): nobody gets it any more.
  [[nodiscard]] virtual std::vector<Received> receive() = 0;
  /// The receiver has done, and stored, all that the message asks for: it need not come again. Needless, and allowed,
  /// for what is retained or best effort. Of a worker, which stores nothing, it holds when what it has sent before has
  /// left.
  virtual void acknowledge(std::uint64_t ticket) = 0;
  /// Work on this message goes on: to be said every few seconds of a long job, or another worker gets it too.
  virtual void still_busy(std::uint64_t ticket) = 0;
};

}  // namespace tutti::bus
