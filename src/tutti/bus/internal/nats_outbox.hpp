// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "tutti/base/result.hpp"
#include "tutti/bus/delivery.hpp"
#include "tutti/bus/envelope.hpp"

namespace tutti::bus {

/// A port's messages to send, in parts, until the bus has confirmed each. It has no clock: callers pass the time.
class Outbox {
 public:
  using Time = std::chrono::steady_clock::time_point;
  struct Piece {
    std::uint64_t number = 0;
    Delivery delivery = Delivery::durable;
    std::string subject;
    std::string id;  ///< to_string(Part); empty where the bus is to keep each.
    std::shared_ptr<const std::string> whole;
    std::size_t begin = 0;
    std::size_t size = 0;
    [[nodiscard]] std::string_view bytes() const { return std::string_view(*whole).substr(begin, size); }
  };

  Outbox(std::string mission, std::uint64_t max_waiting_bytes)
      : mission_(std::move(mission)), max_waiting_bytes_(max_waiting_bytes) {}

  /// Refused: durable messages and jobs above the limit, anything too large. One that is here already changes nothing.
  /// A retained one takes the place of one that waits for the same receiver; status waits for nothing.
  Status add(const Envelope& envelope);
  /// The piece to be sent now, if any: at most so many are without confirmation at a time, and of one retained value
  /// one. It is under way from here on; one that is best effort is forgotten.
  std::optional<Piece> next(Time now);
  /// The bus has it.
  void confirm(std::uint64_t number);
  /// The bus does not take it: again, after a while.
  void refuse(std::uint64_t number, Time now);
  /// Everything under way counts as refused.
  void refuse_all(Time now);
  /// Parts that were under way for too long wait again.
  void expire(Time now);
  /// All that was under way waits again: the connection was gone, and with it maybe the messages.
  void resend_all();
  /// Since when the bus has stored nothing of what was sent; nothing: it has, or nothing was.
  [[nodiscard]] std::optional<Time> unconfirmed_since() const { return unconfirmed_since_; }
  /// It could not.
  void note_cut() { unconfirmed_since_.reset(); }
  /// Best-effort messages are not heard without a connection.
  void forget_best_effort();

  [[nodiscard]] std::size_t messages() const { return waiting_.size() + under_way_.size(); }
  [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

 private:
  /// First status, then retained values, then the rest; within these as they came, but for submaps the newest first:
  /// that of the highest numbers, as many as may have waited here for a link.
  using Order = std::tuple<int, std::uint64_t, std::uint64_t, std::uint64_t>;
  struct UnderWay {
    Piece piece;
    Time until;
  };
  static Order order_of(const Piece& piece);
  void put_back(Piece piece);
  void drop_waiting(Delivery delivery, const std::string* subject);
  [[nodiscard]] bool waits(const Envelope& envelope, std::uint64_t content) const;
  [[nodiscard]] bool is_under_way(const std::string& subject) const;

  std::string mission_;
  std::uint64_t max_waiting_bytes_;
  std::uint64_t bytes_ = 0;  ///< All parts'.
  std::uint64_t next_number_ = 0;
  Time not_before_{};
  std::optional<Time> unconfirmed_since_;
  std::map<Order, Piece> waiting_;
  std::map<std::uint64_t, UnderWay> under_way_;
};

}  // namespace tutti::bus
