// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include "tutti/bus/port.hpp"
#include "tutti/bus/simulated_radio.hpp"

namespace tutti::bus {

/// Ports in virtual time: robots are joined to a broker beside the server by the simulated radio; workers, viewers and
/// server by nothing that takes time. What lies at the broker outlives the ports; what waits at a robot for its radio
/// goes with the robot's port. One without a port hears nothing; retained values are sent when it is there again.
class SimulatedNetwork {
 public:
  explicit SimulatedNetwork(SimulatedRadio radio, Timestamp start) : radio_(std::move(radio)), now_(start) {}
  SimulatedNetwork(const SimulatedNetwork&) = delete;
  SimulatedNetwork& operator=(const SimulatedNetwork&) = delete;

  /// The endpoint's only port; it must not outlive the network.
  [[nodiscard]] std::unique_ptr<Port> connect(Endpoint endpoint);
  /// It is this time now; what has arrived by then is there to be received.
  void advance(Timestamp now);
  /// SimulatedRadio::next_delivery().
  [[nodiscard]] std::optional<Timestamp> next_delivery() const { return radio_.next_delivery(); }
  [[nodiscard]] const SimulatedRadio& radio() const { return radio_; }

 private:
  class SimulatedPort;
  struct Message {
    Envelope envelope;
    bool given = false;  ///< To the present port of its receiver; of a job: to `envelope.to`.
  };
  void send(Envelope envelope);
  void arrive(Envelope envelope);
  void show(Endpoint viewer, Envelope envelope);
  /// A newer value of this one has arrived before it.
  [[nodiscard]] bool is_overtaken(const Arrival& arrival);
  [[nodiscard]] std::vector<Received> receive(Endpoint endpoint);
  void acknowledge(std::uint64_t ticket) { messages_.erase(ticket); }
  void disconnect(Endpoint endpoint);

  SimulatedRadio radio_;
  Timestamp now_;
  std::set<Endpoint> connected_;
  std::uint64_t next_ticket_ = 0;
  std::map<std::uint64_t, Message> messages_;  ///< By ticket: what is there and not acknowledged.
  std::map<std::pair<Endpoint, MessageKind>, Envelope> retained_;
  std::map<std::pair<Endpoint, MessageKind>, std::uint64_t> newest_;  ///< Number of the newest retained one to arrive.
};

}  // namespace tutti::bus
