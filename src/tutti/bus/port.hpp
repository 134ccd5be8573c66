// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/bus/envelope.hpp"

namespace tutti::bus {

/// A message that has arrived, and the ticket that acknowledge() takes for it. A port never gives a ticket twice.
struct Received {
  Envelope envelope;
  std::uint64_t ticket = 0;
};

/// State of a port's link to its bus. Fields that a transport does not have stay 0 or empty.
struct LinkState {
  std::string url = {};    ///< Without credentials.
  bool connected = false;  ///< Connected, and subscribed to all that this port receives.
  std::uint64_t reconnects = 0;
  std::size_t waiting_messages = 0;  ///< Parts of messages that are not sent, or not confirmed by the bus.
  std::uint64_t waiting_bytes = 0;
  std::size_t waiting_acknowledgements = 0;
  std::uint64_t refused = 0;            ///< Messages that arrived and could not be understood, or never became whole.
  std::uint64_t streams_made_anew = 0;  ///< Server's port only: streams that the bus had lost, or gave nothing of.
  std::uint64_t jobs_removed = 0;       ///< Server's port only: jobs that no worker gets any more.
  std::uint64_t strange_jobs = 0;       ///< Server's port only: jobs that it has not sent, and has removed.
  /// Server's port only: how often a worker has said that a job is done, or else, which it had not been given; nothing
  /// has come of it. And the number of the last such worker.
  std::uint64_t strange_settlements = 0;
  std::uint32_t strange_settler = 0;
  /// For how long a connected bus has confirmed nothing of what was sent.
  double unconfirmed_s = 0.0;
  /// The bus's refusal of something that this program did since it connected, in its words; empty: none.
  std::string denied = {};
  /// Server's port only: how often jobs were given to workers since one was last answered, once every job that is out
  /// was given kGivenInVain times on average. 0: jobs are answered.
  std::uint64_t given_in_vain = 0;
  static constexpr std::uint64_t kGivenInVain = 3;
  /// Server's port only: for how long jobs have waited while no worker had one.
  double jobs_untaken_s = 0.0;
  std::string last_error = {};
};

/// Connects one endpoint to the others; an endpoint has one port at a time. bus/delivery.hpp states what is guaranteed
/// for each kind of message. A port is used by one thread. port_conformance_test.cpp checks every implementation
/// against this contract.
class Port {
 public:
  /// A message that was received and not acknowledged comes again at once to the next port of this endpoint, a job to
  /// any worker. A message that was sent and has not left yet may be lost; whoever needs it sends it again after a
  /// start.
  virtual ~Port() = default;
  /// Takes a message, which leaves when it can; never waits for the network. `envelope.from` is this endpoint. A
  /// retained message takes the place of the last one to the same receiver. Any other message with the kind and id of
  /// one that has not left yet changes nothing. On an error the message was not taken, because too many wait or the
  /// port may not connect yet, and must be sent again later.
  [[nodiscard]] virtual Status send(Envelope envelope) = 0;
  /// Returns what has come, without waiting. A worker gets one job at a time: the next one comes when the last is
  /// acknowledged. A job that has ended every worker that had it may come back to the server, from any_worker(), and
  /// then nobody gets it any more.
  [[nodiscard]] virtual std::vector<Received> receive() = 0;
  /// Reports that the receiver has done, and stored, all that the message asks for, so that it does not come again. Not
  /// needed, but allowed, for messages that are retained or best effort. A worker stores nothing: its acknowledgement
  /// leaves after all that it has sent before.
  virtual void acknowledge(std::uint64_t ticket) = 0;
  /// Reports that work on this message goes on. If a worker does not call this every few seconds during
  /// a long job, another worker gets the job, too.
  virtual void still_busy(std::uint64_t ticket) = 0;
  /// A port whose link cannot be lost is always connected.
  [[nodiscard]] virtual LinkState state() const { return {.connected = true}; }
};

}  // namespace tutti::bus
