// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "tutti/bus/broker.hpp"
#include "tutti/bus/port.hpp"
#include "tutti/bus/simulated_radio.hpp"

namespace tutti::bus {

/// Ports in virtual time: the simulated radio joins robots to a broker beside the server; workers, viewers and the
/// server reach the broker without delay. Messages at the broker outlive the ports; messages that wait at a robot for
/// its radio are lost with the robot's port. One thread at a time.
class SimulatedNetwork {
 public:
  explicit SimulatedNetwork(SimulatedRadio radio, Timestamp start) : radio_(std::move(radio)), now_(start) {}
  SimulatedNetwork(const SimulatedNetwork&) = delete;
  SimulatedNetwork& operator=(const SimulatedNetwork&) = delete;

  /// Makes the endpoint's port, of which there may be one at a time. It must not outlive the network.
  [[nodiscard]] std::unique_ptr<Port> connect(Endpoint endpoint);
  /// Sets the time, which never goes back; messages that have arrived by then can be received.
  void advance(Timestamp now);
  /// SimulatedRadio::next_delivery().
  [[nodiscard]] std::optional<Timestamp> next_delivery() const { return radio_.next_delivery(); }
  [[nodiscard]] const SimulatedRadio& radio() const { return radio_; }

 private:
  class SimulatedPort;
  void send(Envelope envelope);
  void carry(Envelope envelope);
  /// True for a retained value that arrives after a newer one.
  [[nodiscard]] bool is_overtaken(const Arrival& arrival);
  void disconnect(Endpoint endpoint);

  SimulatedRadio radio_;
  Timestamp now_;
  Broker broker_;
  /// Number of the newest retained message that has arrived.
  std::map<std::pair<Endpoint, MessageKind>, std::uint64_t> newest_;
};

}  // namespace tutti::bus
