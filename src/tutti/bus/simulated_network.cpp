// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/simulated_network.hpp"

#include <algorithm>

#include "tutti/base/check.hpp"
#include "tutti/bus/delivery.hpp"

namespace tutti::bus {
namespace {

bool is_job(MessageKind kind) { return delivery_of(kind) == Delivery::work_queue; }
/// Comes again until it is acknowledged.
bool is_owed(MessageKind kind) { return is_job(kind) || delivery_of(kind) == Delivery::durable; }

}  // namespace

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
  std::vector<Received> receive() override { return network_.receive(endpoint_); }
  void acknowledge(std::uint64_t ticket) override { network_.acknowledge(ticket); }
  void still_busy(std::uint64_t /*ticket*/) override {}  // a job stays with its worker's port

 private:
  SimulatedNetwork& network_;
  Endpoint endpoint_;
};

std::unique_ptr<Port> SimulatedNetwork::connect(Endpoint endpoint) {
  TUTTI_CHECK(connected_.insert(endpoint).second, "a second port of one endpoint");
  auto port = std::make_unique<SimulatedPort>(*this, endpoint);
  for (const auto& [key, envelope] : retained_) {
    if (key.first == endpoint) radio_.send(now_, envelope);
    if (key.first == Endpoint::all_viewers() && endpoint.role == Endpoint::Role::viewer) show(endpoint, envelope);
  }
  return port;
}

void SimulatedNetwork::advance(Timestamp now) {
  now_ = now;
  for (Arrival& arrival : radio_.deliver_until(now))
    if (!is_overtaken(arrival)) arrive(std::move(arrival));
}

bool SimulatedNetwork::is_overtaken(const Arrival& arrival) {
  if (delivery_of(arrival.kind) != Delivery::retained) return false;
  std::uint64_t& newest = newest_[{arrival.to, arrival.kind}];
  if (arrival.number < newest) return true;
  newest = arrival.number;
  return false;
}

void SimulatedNetwork::send(Envelope envelope) {
  if (delivery_of(envelope.kind) == Delivery::retained)
    retained_.insert_or_assign(std::pair{envelope.to, envelope.kind}, envelope);
  if (envelope.from.robot() || envelope.to.robot()) return radio_.send(now_, std::move(envelope));
  if (envelope.to != Endpoint::all_viewers()) return arrive(std::move(envelope));
  for (const Endpoint endpoint : connected_)
    if (endpoint.role == Endpoint::Role::viewer) show(endpoint, envelope);
}

void SimulatedNetwork::show(Endpoint viewer, Envelope envelope) {
  envelope.to = viewer;
  arrive(std::move(envelope));
}

void SimulatedNetwork::arrive(Envelope envelope) {
  if (!is_owed(envelope.kind) && !connected_.contains(envelope.to)) return;
  if (delivery_of(envelope.kind) == Delivery::retained)
    std::erase_if(messages_, [&](const auto& entry) {
      const Envelope& there = entry.second.envelope;
      return there.to == envelope.to && there.kind == envelope.kind;
    });
  messages_.emplace(next_ticket_++, Message{std::move(envelope)});
}

std::vector<Received> SimulatedNetwork::receive(Endpoint endpoint) {
  std::vector<Received> received;
  bool takes_job =
      endpoint.role == Endpoint::Role::worker && std::ranges::none_of(messages_, [&](const auto& entry) {
        return entry.second.given && entry.second.envelope.to == endpoint && is_job(entry.second.envelope.kind);
      });
  for (auto entry = messages_.begin(); entry != messages_.end();) {
    auto& [ticket, message] = *entry;
    const bool is_own = message.envelope.to == endpoint;
    const bool is_for_any = takes_job && message.envelope.to == Endpoint::any_worker();
    if (message.given || !(is_own || is_for_any)) {
      ++entry;
      continue;
    }
    if (is_for_any) {
      takes_job = false;
      message.envelope.to = endpoint;
    }
    message.given = true;
    received.push_back({message.envelope, ticket});
    entry = is_owed(message.envelope.kind) ? std::next(entry) : messages_.erase(entry);
  }
  return received;
}

void SimulatedNetwork::disconnect(Endpoint endpoint) {
  connected_.erase(endpoint);
  if (endpoint.robot()) radio_.forget_waiting(endpoint);
  std::erase_if(messages_, [&](const auto& entry) {
    return entry.second.envelope.to == endpoint && !is_owed(entry.second.envelope.kind);
  });
  for (auto& [ticket, message] : messages_) {
    if (message.envelope.to != endpoint) continue;
    message.given = false;
    if (is_job(message.envelope.kind)) message.envelope.to = Endpoint::any_worker();
  }
}

}  // namespace tutti::bus
