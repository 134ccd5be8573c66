// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tutti/bus/internal/nats_names.hpp"
#include "tutti/bus/port.hpp"

namespace tutti::bus {

/// A port's messages, each from its first part until it is acknowledged on the bus. A message that comes again
/// meanwhile is not given again (the bus thinks that 30 s are long), nor for some time after: a bus that is killed
/// forgets acknowledgements.
///
/// Messages that are not whole wait for their other parts, so many of a sender and in all; then those that have not
/// grown for longest are given up, as those are that have not for kLongestHalf: acknowledged without having been given.
/// A sender of ours sends such a message again, and the bus takes it again after a while.
class Inbox {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::size_t kMostHalves = 16;                         ///< A sender's.
  static constexpr std::size_t kMostHalfBytes = std::size_t{20} << 20U;  ///< Likewise; more than one message has.
  static constexpr std::size_t kMostHalvesInAll = 4096;
  static constexpr std::size_t kMostHalfBytesInAll = std::size_t{128} << 20U;
  static constexpr auto kLongestHalf =
      std::chrono::hours(3);  ///< Longer than the bus knows an id (nats_connection.cpp).

  explicit Inbox(Endpoint self) : self_(self) {}

  /// A part of a durable message or a job; `reply`: where the bus awaits its acknowledgement. False: it does not fit to
  /// the parts that came before, or the whole does not fit its id. `user`: Envelope::user.
  bool add_part(Endpoint from, const Part& part, std::string_view bytes, std::string reply, Time now = {},
                const std::string& user = {});
  /// In the place of one of its kind that is not taken yet.
  void put_retained(Endpoint from, MessageKind kind, std::string bytes);
  /// A job of ours that no worker gets any more.
  void put_returned(MessageKind kind, std::string id, std::string bytes);
  /// Keeps the newest status of each sender. When there are too many that nobody has taken, of a sender or in all, the
  /// oldest go.
  void put_best_effort(Endpoint from, MessageKind kind, std::string bytes);

  std::vector<Received> take();
  void acknowledge(std::uint64_t ticket);
  /// Where the bus is to learn that work on the message goes on.
  [[nodiscard]] std::vector<std::string> replies_of(std::uint64_t ticket) const;

  struct Acknowledgement {
    std::uint64_t ticket = 0;
    std::vector<std::string> replies;
  };
  /// The oldest that the bus does not know.
  [[nodiscard]] std::optional<Acknowledgement> next_acknowledgement() const;
  /// The bus has lost its stream of these, so where to acknowledge them is void. Parts of messages that are not whole
  /// are forgotten; whole ones are still to be acknowledged, and nobody learns of it.
  void forget_stream(MessageKind kind);
  /// The bus knows, or cannot be reached and will send the message again: it is forgotten here.
  void forget(std::uint64_t ticket);
  /// Where messages that came again although they are acknowledged are to be acknowledged once more.
  [[nodiscard]] std::vector<std::string> take_strays() { return std::exchange(strays_, {}); }
  [[nodiscard]] std::size_t acknowledgements() const { return acknowledged_.size(); }
  /// Everything that is not acknowledged, whole or not.
  [[nodiscard]] std::vector<std::string> unacknowledged() const;

  /// Whole messages that are not acknowledged to the bus.
  [[nodiscard]] std::uint64_t held_bytes() const { return held_bytes_; }
  [[nodiscard]] std::size_t held_messages() const { return held_.size(); }
  /// Messages so far that never became whole.
  [[nodiscard]] std::uint64_t given_up() const { return given_up_; }

 private:
  /// From; of the part; Envelope::user.
  using Name = std::tuple<Endpoint, MessageKind, std::string, std::optional<std::uint64_t>, std::string>;
  struct Message {
    Assembly assembly;
    std::uint64_t ticket = 0;  ///< 0: not whole yet.
    std::uint64_t size = 0;
    bool acknowledged = false;
    std::uint64_t grown = 0;  ///< Where in halves_, while it is not whole.
    std::size_t half_bytes = 0;
    Time since;  ///< It has grown.
  };
  using Messages = std::map<Name, Message>;
  struct Halves {
    std::size_t messages = 0;
    std::size_t bytes = 0;
  };

  /// It is not whole, and has come to have `bytes` more.
  void note_growth(Messages::iterator half, std::size_t bytes, Time now);
  /// It is whole, or goes.
  void forget_half(Messages::iterator half);
  void give_up(Messages::iterator half);
  void keep_bounds(Endpoint from, Time now);
  /// The half that has not grown for longest, of this sender.
  [[nodiscard]] Messages::iterator oldest_half_of(Endpoint from);

  Endpoint self_;
  std::uint64_t last_ticket_ = 0;
  std::uint64_t held_bytes_ = 0;
  Messages messages_;
  std::uint64_t growths_ = 0;
  std::map<std::uint64_t, Name> halves_;  ///< By when they last grew.
  std::map<Endpoint, Halves> halves_of_;
  Halves all_halves_;
  std::uint64_t given_up_ = 0;
  std::map<std::uint64_t, Name> held_;  ///< By ticket.
  std::deque<std::uint64_t> acknowledged_;
  std::deque<Received> untaken_;
  std::set<Name> done_;  ///< The last ones that were acknowledged.
  std::deque<Name> done_in_order_;
  std::vector<std::string> strays_;
};

}  // namespace tutti::bus
