// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace tutti::page {

/// What the page is sent: a key, and its value as JSON; "null": there is no such thing any more. A later message of a
/// key replaces the earlier one, so a page that comes late needs the last of each. docs/page.md lists the keys.
struct Message {
  std::string key;
  double time_s = 0.0;  ///< Mission time.
  std::string value;
  friend bool operator==(const Message&, const Message&) = default;
};

/// {"key":..,"t":..,"value":..}
std::string to_json(const Message& message);

/// The last message of each key, in the order in which they came. Memory is bounded by what there is to show.
class Board {
 public:
  /// Takes the message, unless its value is what the board has; returns whether.
  bool put(Message message);
  /// Takes the messages of all keys that begin with `prefix`: keys that are on the board and not among these end.
  void put_all(std::string_view prefix, std::vector<Message> messages, double time_s);
  /// Counts what was taken.
  [[nodiscard]] std::uint64_t sequence() const { return sequence_; }
  /// What was taken after `sequence`, each key once, in order; at first call with 0: everything.
  [[nodiscard]] std::vector<std::shared_ptr<const Message>> after(std::uint64_t sequence) const;

 private:
  struct Entry {
    std::uint64_t sequence = 0;
    std::shared_ptr<const Message> message;
  };
  std::map<std::string, Entry, std::less<>> by_key_;
  std::map<std::uint64_t, std::string> order_;
  std::uint64_t sequence_ = 0;
};

}  // namespace tutti::page
