// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bus/simulated_radio.hpp"

#include <algorithm>
#include <limits>

#include "tutti/base/check.hpp"
#include "tutti/bus/delivery.hpp"

namespace tutti::bus {
namespace {

/// Worth sending only until there is a newer one.
bool only_latest_counts(MessageKind kind) { return delivery_of(kind) == Delivery::retained; }

/// First time not before `t` with contact; the last timestamp: never.
Timestamp in_contact(const LinkConfig& link, Timestamp start, Timestamp t) {
  for (bool moved = true; moved;) {
    moved = false;
    for (const Outage& outage : link.outages) {
      const Timestamp until = start + outage.until_s;
      if (t < start + outage.from_s || t >= until) continue;
      t = until;
      moved = true;
    }
  }
  return t;
}

/// When `airtime_s` with contact have passed since `t`.
Timestamp after_airtime(const LinkConfig& link, Timestamp start, Timestamp t, double airtime_s) {
  while (true) {
    t = in_contact(link, start, t);
    Timestamp lost = kLastTimestamp;
    for (const Outage& outage : link.outages)
      if (const Timestamp from = start + outage.from_s; from > t && outage.until_s > outage.from_s)
        lost = std::min(lost, from);
    if (t + airtime_s <= lost) return t + airtime_s;
    airtime_s = std::max(0.0, airtime_s - (lost - t));
    t = lost;
  }
}

/// How long the repetitions of a message last sent at `t` wait for contact, beside the time between them.
double wait_of_repetitions(const LinkConfig& link, Timestamp start, Timestamp t, int repetitions) {
  double waited_s = 0.0;
  for (int i = 0; i < repetitions; ++i) {
    const Timestamp due = t + link.retransmit_s;
    t = in_contact(link, start, due);
    if (t == kLastTimestamp) return std::numeric_limits<double>::infinity();
    waited_s += t - due;
  }
  return waited_s;
}

}  // namespace

SimulatedRadio::SimulatedRadio(Timestamp start, const LinkConfig& link, std::uint64_t seed)
    : start_(start), now_(start), link_(link), rng_(seed) {}

void SimulatedRadio::set_link(RobotId robot, const LinkConfig& link) {
  for (const auto& [ends, direction] : directions_)
    TUTTI_CHECK(ends.first.robot() != robot && ends.second.robot() != robot, "robot {} has sent already", robot.value);
  links_[robot] = link;
}

const LinkConfig& SimulatedRadio::link_of(RobotId robot) const {
  const auto own = links_.find(robot);
  return own == links_.end() ? link_ : own->second;
}

Timestamp SimulatedRadio::last_contact(RobotId robot, Timestamp now) const {
  const LinkConfig& link = link_of(robot);
  if (in_contact(link, start_, now) == now) return now;
  Timestamp last = now;
  for (bool moved = true; moved;) {
    moved = false;
    for (const Outage& outage : link.outages) {
      const Timestamp from = start_ + outage.from_s;
      if (from >= last || last > start_ + outage.until_s) continue;
      last = from;
      moved = true;
    }
  }
  return last;
}

SimulatedRadio::Direction& SimulatedRadio::direction(Endpoint from, Endpoint to) {
  const auto found = directions_.find({from, to});
  if (found != directions_.end()) return found->second;
  Direction created{.free_at = start_, .last_arrival = start_};
  created.link = link_of(from.robot() ? *from.robot() : *to.robot());
  return directions_.emplace(std::pair{from, to}, std::move(created)).first->second;
}

TopicStatistics& SimulatedRadio::statistics_of(const Envelope& message) {
  return statistics_[{message.from, message.to, message.kind}];
}

void SimulatedRadio::send(Timestamp now, Envelope sent) {
  TUTTI_CHECK(now >= now_, "time goes back from {} to {} ns", now_.ns, now.ns);
  const Endpoint server = Endpoint::server();
  TUTTI_CHECK((sent.from == server && sent.to.robot()) || (sent.from.robot() && sent.to == server),
              "the radio joins robots to the server");
  TUTTI_CHECK(sent.bytes != nullptr, "a message without bytes");
  now_ = now;
  advance(now);
  const Arrival message{std::move(sent), now, {}, next_number_++};
  TopicStatistics& statistics = statistics_of(message);
  ++statistics.published;
  statistics.published_bytes += message.bytes->size();
  statistics.largest_message = std::max<std::uint64_t>(statistics.largest_message, message.bytes->size());
  Direction& channel = direction(message.from, message.to);
  if (only_latest_counts(message.kind))
    statistics.superseded +=
        std::erase_if(channel.queue, [&](const Waiting& w) { return w.message.kind == message.kind; });
  const auto is_same = [&](const Waiting& w) { return w.message.kind == message.kind && w.message.id == message.id; };
  if (delivery_of(message.kind) == Delivery::durable && !message.id.empty() &&
      std::ranges::any_of(channel.queue, is_same))
    return;
  if (channel.queue.size() >= static_cast<std::size_t>(channel.link.queue_messages)) {
    ++statistics_of(channel.queue.front().message).dropped;
    channel.queue.pop_front();
  }
  channel.queue.push_back({sent_[message.kind]++, message});
  advance(now);
}

Timestamp SimulatedRadio::transmission_start(const Direction& channel) const {
  return in_contact(channel.link, start_, std::max(channel.free_at, channel.queue.front().message.sent));
}

/// Sends the front of the queue.
void SimulatedRadio::transmit(Direction& channel, Timestamp start) {
  const LinkConfig& link = channel.link;
  const Waiting front = std::move(channel.queue.front());
  channel.queue.pop_front();
  Arrival message = front.message;
  TopicStatistics& statistics = statistics_of(message);

  Rng rng = rng_.fork(static_cast<std::uint64_t>(message.kind)).fork(front.of_kind);
  int attempts = 1;
  bool arrives = !rng.bernoulli(link.loss);
  while (!arrives && message.kind != MessageKind::proxy_graph_delta) {
    ++attempts;
    arrives = !rng.bernoulli(link.loss);
  }
  const auto size = static_cast<double>(message.bytes->size());
  const double airtime_s = link.bandwidth_bytes_per_s > 0.0 ? attempts * size / link.bandwidth_bytes_per_s : 0.0;
  channel.free_at = after_airtime(link, start_, start, airtime_s);
  statistics.transmitted_bytes += static_cast<std::uint64_t>(attempts) * message.bytes->size();
  if (!arrives) {
    ++statistics.lost;
    return;
  }
  const double retransmissions_s =
      (attempts - 1) * link.retransmit_s + wait_of_repetitions(link, start_, channel.free_at, attempts - 1);
  const int copies = rng.bernoulli(link.duplicate) ? 2 : 1;
  for (int copy = 0; copy < copies; ++copy) {
    message.arrived = channel.free_at + (retransmissions_s + link.latency_s + rng.uniform(0.0, 1.0) * link.jitter_s);
    if (link.in_order) message.arrived = std::max(message.arrived, channel.last_arrival);
    channel.last_arrival = std::max(channel.last_arrival, message.arrived);
    in_flight_.emplace(std::pair{message.arrived, message.number}, message);
  }
}

void SimulatedRadio::advance(Timestamp now) {
  for (auto& [ends, channel] : directions_)
    while (!channel.queue.empty()) {
      const Timestamp start = transmission_start(channel);
      if (start > now) break;
      transmit(channel, start);
    }
}

std::vector<Arrival> SimulatedRadio::deliver_until(Timestamp now) {
  TUTTI_CHECK(now >= now_, "time goes back from {} to {} ns", now_.ns, now.ns);
  now_ = now;
  advance(now);
  std::vector<Arrival> arrived;
  const auto end = in_flight_.upper_bound({now, std::numeric_limits<std::uint64_t>::max()});
  for (auto at = in_flight_.begin(); at != end; ++at) {
    ++statistics_of(at->second).delivered;
    arrived.push_back(std::move(at->second));
  }
  in_flight_.erase(in_flight_.begin(), end);
  return arrived;
}

std::optional<Timestamp> SimulatedRadio::next_delivery() const {
  std::optional<Timestamp> next;
  const auto consider = [&](Timestamp t) {
    if (t < kLastTimestamp) next = next ? std::min(*next, t) : t;
  };
  if (!in_flight_.empty()) consider(in_flight_.begin()->first.first);
  for (const auto& [ends, channel] : directions_)
    if (!channel.queue.empty()) consider(transmission_start(channel));
  return next;
}

void SimulatedRadio::forget_waiting(Endpoint from) {
  for (auto& [ends, channel] : directions_)
    if (ends.first == from) channel.queue.clear();
}

std::map<SimulatedRadio::Topic, std::size_t> SimulatedRadio::undelivered() const {
  std::map<Topic, std::size_t> count;
  const auto add = [&](const Envelope& message) { ++count[{message.from, message.to, message.kind}]; };
  for (const auto& [arrival, message] : in_flight_) add(message);
  for (const auto& [ends, channel] : directions_)
    for (const Waiting& waiting : channel.queue) add(waiting.message);
  return count;
}

}  // namespace tutti::bus
