// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/history/message.hpp"

namespace tutti::page {

using history::Message;

/// {"key":..,"t":..,"value":..}
std::string to_json(const Message& message);

/// A message on a board, with its text as everybody who watches is sent it: there is one, whoever watches.
class Posted {
 public:
  Posted(const Message& message, std::uint64_t sequence);
  [[nodiscard]] std::uint64_t sequence() const { return sequence_; }
  /// to_json()
  [[nodiscard]] const std::string& json() const { return json_; }
  [[nodiscard]] std::string_view value() const {
    return std::string_view(json_).substr(value_at_, json_.size() - value_at_ - 1);
  }
  [[nodiscard]] Message message() const { return {key_, time_s_, std::string(value())}; }

 private:
  std::string key_;
  double time_s_;
  std::uint64_t sequence_;
  std::string json_;
  std::size_t value_at_;
};

/// The last message of each key, in the order in which they came. Memory is bounded by what there is to show.
class Board {
 public:
  /// Takes the message, unless its value is what the board has; returns whether.
  bool put(const Message& message);
  /// Takes the messages of all keys that begin with `prefix`: keys that are on the board and not among these end.
  void put_all(std::string_view prefix, const std::vector<Message>& messages, double time_s);
  /// Counts what was taken.
  [[nodiscard]] std::uint64_t sequence() const { return sequence_; }
  /// The messages taken after `sequence`, each key once, in order; at first call with 0: everything.
  [[nodiscard]] std::vector<std::shared_ptr<const Posted>> after(std::uint64_t sequence) const;

 private:
  std::map<std::string, std::shared_ptr<const Posted>, std::less<>> by_key_;
  std::map<std::uint64_t, std::string> order_;
  std::uint64_t sequence_ = 0;
};

}  // namespace tutti::page
