// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <compare>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/bus/envelope.hpp"

namespace tutti::bus {

/// Limit on the times of a link: no radio takes longer, and a robot that is away for longer has an outage.
inline constexpr double kLongestLinkTime_s = 3600.0;

/// Time without contact: [from_s, until_s) in seconds after the radio's start; infinity means for ever.
struct Outage {
  double from_s = 0.0;
  double until_s = 0.0;
  template <class V>
  void describe(V& v) {
    v.field("from_s", from_s, at_least(0.0), "Contact is lost, seconds after the start of the mission.");
    v.field("until_s", until_s, at_least(0.0), "Contact is back; .inf = never.");
  }
};

/// The radio between one robot and the server, with equal properties in both directions.
struct LinkConfig {
  double latency_s = 0.02;
  double jitter_s = 0.0;
  double loss = 0.0;
  double retransmit_s = 0.5;  ///< A lost transmission is repeated after this time, once there is contact.
  double duplicate = 0.0;     ///< Share of messages that arrive twice.
  bool in_order = false;      ///< Messages of one direction never overtake each other.
  double bandwidth_bytes_per_s = 0.0;
  int queue_messages = 10000;  ///< Messages that wait for contact or bandwidth; then the oldest is dropped.
  std::vector<Outage> outages;
  template <class V>
  void describe(V& v) {
    v.field("latency_s", latency_s, between(0.0, kLongestLinkTime_s), "Time from sending to arrival.");
    v.field("jitter_s", jitter_s, between(0.0, kLongestLinkTime_s),
            "Up to this much later, at random; larger than the spacing = reordered.");
    v.field("loss", loss, between(0.0, 0.95),
            "Share of transmissions lost; all but deltas of proxy graphs are sent again.");
    v.field("bandwidth_bytes_per_s", bandwidth_bytes_per_s, between(0.0, 1e12), "0 = unlimited.");
    v.field("outages", outages, any(), "Times out of range; messages wait, also one that is half sent.");
  }
};

/// A message that has arrived.
struct Arrival : Envelope {
  Timestamp sent;
  Timestamp arrived;
  std::uint64_t number = 0;  ///< Counts all messages in the order of sending.
};

/// Counts for one SimulatedRadio::Topic.
struct TopicStatistics {
  std::uint64_t published = 0;          ///< Messages.
  std::uint64_t delivered = 0;          ///< Messages, duplicates of the link included.
  std::uint64_t lost = 0;               ///< Messages that the link lost and did not repeat: deltas of proxy graphs.
  std::uint64_t superseded = 0;         ///< Waiting retained messages that a newer one replaced.
  std::uint64_t dropped = 0;            ///< Messages dropped because the queue was full.
  std::uint64_t published_bytes = 0;    ///< Bytes of the published messages.
  std::uint64_t transmitted_bytes = 0;  ///< Bytes on the radio, repetitions included.
  std::uint64_t largest_message = 0;    ///< Bytes of the largest published message.
  friend bool operator==(const TopicStatistics&, const TopicStatistics&) = default;
};

/// The radio between robots and server in virtual time, without threads. Each robot has one link to the server; one end
/// of every message is the server. A message's fate is drawn from (seed, its kind, its number), so the same
/// calls give the same arrivals, whatever other kinds are sent beside it. A message waits in the bounded queue of its
/// direction until there is contact and bandwidth; its airtime passes with contact only, its latency always. Only the
/// newest waiting retained message (delivery.hpp) of a kind is kept, and a durable one that already waits is not queued
/// twice. A lost delta of a proxy graph stays lost (a newer one follows); all other messages are sent again,
/// when there is contact, until they arrive.
class SimulatedRadio {
 public:
  SimulatedRadio(Timestamp start, const LinkConfig& link, std::uint64_t seed);

  /// Gives one robot a link of its own; to be called before its first message.
  void set_link(RobotId robot, const LinkConfig& link);
  /// `now` while the robot is in range, else when it went out of it (LinkConfig::outages).
  [[nodiscard]] Timestamp last_contact(RobotId robot, Timestamp now) const;
  /// Hands a message to the radio at time `now`, which never goes back. A full queue drops its oldest message.
  void send(Timestamp now, Envelope message);
  /// Returns the messages that have arrived by `now` since the last call, in the order of arrival; one that the link
  /// duplicates comes twice.
  std::vector<Arrival> deliver_until(Timestamp now);
  /// Nothing arrives before this time, and nothing ever arrives when there is none. deliver_until() at this time may
  /// still return nothing: a message that only now leaves its queue arrives later.
  [[nodiscard]] std::optional<Timestamp> next_delivery() const;

  using Topic = std::tuple<Endpoint, Endpoint, MessageKind>;  ///< (from, to, kind)
  /// Per topic the number of messages that wait or are under way.
  [[nodiscard]] std::map<Topic, std::size_t> undelivered() const;
  /// Drops the messages that have not left this endpoint yet, as when its program ends.
  void forget_waiting(Endpoint from);
  [[nodiscard]] const std::map<Topic, TopicStatistics>& statistics() const { return statistics_; }

 private:
  struct Waiting {
    std::uint64_t of_kind = 0;  ///< Counts the messages of its kind.
    Arrival message;
  };
  struct Direction {
    LinkConfig link;
    std::deque<Waiting> queue;
    Timestamp free_at;  ///< The bandwidth is in use until here.
    Timestamp last_arrival;
  };
  [[nodiscard]] const LinkConfig& link_of(RobotId robot) const;
  Direction& direction(Endpoint from, Endpoint to);
  void transmit(Direction& direction, Timestamp start);
  void advance(Timestamp now);
  [[nodiscard]] Timestamp transmission_start(const Direction& direction) const;
  TopicStatistics& statistics_of(const Envelope& message);

  Timestamp start_;
  Timestamp now_;
  LinkConfig link_;
  Rng rng_;
  std::uint64_t next_number_ = 0;
  std::map<MessageKind, std::uint64_t> sent_;  ///< Number of messages sent.
  std::map<RobotId, LinkConfig> links_;
  std::map<std::pair<Endpoint, Endpoint>, Direction> directions_;
  /// By arrival and number: of equal arrivals, what was sent first.
  std::multimap<std::pair<Timestamp, std::uint64_t>, Arrival> in_flight_;
  std::map<Topic, TopicStatistics> statistics_;
};

}  // namespace tutti::bus
