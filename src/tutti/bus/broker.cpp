// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/broker.hpp"

#include <algorithm>

#include "tutti/base/check.hpp"
#include "tutti/bus/delivery.hpp"

namespace tutti::bus {
namespace {

bool is_job(MessageKind kind) { return delivery_of(kind) == Delivery::work_queue; }
/// Comes again until it is acknowledged.
bool is_owed(MessageKind kind) { return is_job(kind) || delivery_of(kind) == Delivery::durable; }

Envelope addressed(Envelope envelope, Endpoint to) {
  envelope.to = to;
  return envelope;
}

}  // namespace

std::vector<Envelope> Broker::connect(Endpoint endpoint) {
  TUTTI_CHECK(connected_.insert(endpoint).second, "a second port of one endpoint");
  std::vector<Envelope> due;
  for (const auto& [key, envelope] : retained_)
    if (key.first == endpoint || (key.first == Endpoint::all_viewers() && endpoint.role == Endpoint::Role::viewer))
      due.push_back(addressed(envelope, endpoint));
  return due;
}

void Broker::retain(const Envelope& envelope) {
  if (delivery_of(envelope.kind) == Delivery::retained)
    retained_.insert_or_assign(std::pair{envelope.to, envelope.kind}, envelope);
}

void Broker::arrive(Envelope envelope) {
  if (envelope.to != Endpoint::all_viewers()) return put(std::move(envelope));
  for (const Endpoint endpoint : connected_)
    if (endpoint.role == Endpoint::Role::viewer) put(addressed(envelope, endpoint));
}

void Broker::put(Envelope envelope) {
  if (!is_owed(envelope.kind) && !connected_.contains(envelope.to)) return;
  if (delivery_of(envelope.kind) == Delivery::retained)
    std::erase_if(messages_, [&](const auto& entry) {
      const Envelope& there = entry.second.envelope;
      return there.to == envelope.to && there.kind == envelope.kind;
    });
  messages_.emplace(next_ticket_++, Message{std::move(envelope)});
}

std::vector<Received> Broker::receive(Endpoint endpoint) {
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

void Broker::disconnect(Endpoint endpoint) {
  connected_.erase(endpoint);
  std::erase_if(messages_, [&](const auto& entry) {
    return entry.second.envelope.to == endpoint && !is_owed(entry.second.envelope.kind);
  });
  for (auto& [ticket, message] : messages_) {
    if (message.envelope.to != endpoint) continue;
    message.given = false;
    if (is_job(message.envelope.kind)) message.envelope.to = Endpoint::any_worker();
  }
}

std::uint64_t Broker::bytes_of(Endpoint from) const {
  std::uint64_t bytes = 0;
  for (const auto& [ticket, message] : messages_)
    if (message.envelope.from == from) bytes += message.envelope.bytes->size();
  return bytes;
}

bool Broker::is_waiting(const Envelope& envelope) const {
  return is_owed(envelope.kind) && std::ranges::any_of(messages_, [&](const auto& entry) {
           const auto& [there, given] = entry.second;
           return !given && there.from == envelope.from && there.kind == envelope.kind && there.id == envelope.id;
         });
}

}  // namespace tutti::bus
