// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/simulated_network.hpp"

#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/bus/delivery.hpp"

namespace tutti::bus {

class SimulatedNetwork::SimulatedPort final : public Port {
 public:
  SimulatedPort(SimulatedNetwork& network, Endpoint endpoint) : network_(network), endpoint_(endpoint) {}
  ~SimulatedPort() override { network_.disconnect(endpoint_); }
  SimulatedPort(const SimulatedPort&) = delete;
  SimulatedPort& operator=(const SimulatedPort&) = delete;

  Status send(Envelope envelope) override {
    TUTTI_CHECK(envelope.from == endpoint_, "a message of somebody else");
    TUTTI_CHECK(envelope.bytes != nullptr, "a message without bytes");
    network_.send(std::move(envelope));
    return {};
  }
  std::vector<Received> receive() override { return network_.broker_.receive(endpoint_); }
  void acknowledge(std::uint64_t ticket) override { network_.broker_.acknowledge(ticket); }
  void still_busy(std::uint64_t /*ticket*/) override {}  // a job stays with its worker's port

 private:
  SimulatedNetwork& network_;
  Endpoint endpoint_;
};

std::unique_ptr<Port> SimulatedNetwork::connect(Endpoint endpoint) {
  for (Envelope& envelope : broker_.connect(endpoint)) carry(std::move(envelope));
  return std::make_unique<SimulatedPort>(*this, endpoint);
}

void SimulatedNetwork::advance(Timestamp now) {
  now_ = now;
  for (Arrival& arrival : radio_.deliver_until(now))
    if (!is_overtaken(arrival)) broker_.arrive(std::move(arrival));
}

bool SimulatedNetwork::is_overtaken(const Arrival& arrival) {
  if (delivery_of(arrival.kind) != Delivery::retained) return false;
  std::uint64_t& newest = newest_[{arrival.to, arrival.kind}];
  if (arrival.number < newest) return true;
  newest = arrival.number;
  return false;
}

void SimulatedNetwork::send(Envelope envelope) {
  broker_.retain(envelope);
  carry(std::move(envelope));
}

void SimulatedNetwork::carry(Envelope envelope) {
  if (envelope.from.robot() || envelope.to.robot()) return radio_.send(now_, std::move(envelope));
  broker_.arrive(std::move(envelope));
}

void SimulatedNetwork::disconnect(Endpoint endpoint) {
  broker_.disconnect(endpoint);
  if (endpoint.robot()) radio_.forget_waiting(endpoint);
}

}  // namespace tutti::bus
