// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/board.hpp"

#include <nlohmann/json.hpp>
#include <utility>

namespace tutti::page {

std::string to_json(const Message& message) {
  const nlohmann::json key = message.key, time = message.time_s;
  return "{\"key\":" + key.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + ",\"t\":" + time.dump() +
         ",\"value\":" + message.value + "}";
}

Posted::Posted(const Message& message, std::uint64_t sequence)
    : key_(message.key),
      time_s_(message.time_s),
      sequence_(sequence),
      json_(to_json(message)),
      value_at_(json_.size() - message.value.size() - 1) {}

bool Board::put(const Message& message) {
  auto [found, is_new] = by_key_.try_emplace(message.key);
  if (!is_new && found->second->value() == message.value) return false;
  if (!is_new) order_.erase(found->second->sequence());
  found->second = std::make_shared<const Posted>(message, ++sequence_);
  order_.emplace(sequence_, message.key);
  return true;
}

/// A key that has ended stays as "null": a page that was away is to hear of it.
void Board::put_all(std::string_view prefix, const std::vector<Message>& messages, double time_s) {
  std::set<std::string, std::less<>> keys;
  for (const Message& message : messages) keys.insert(message.key);
  std::vector<std::string> ended;
  for (auto entry = by_key_.lower_bound(prefix); entry != by_key_.end() && entry->first.starts_with(prefix); ++entry)
    if (!keys.contains(entry->first)) ended.push_back(entry->first);
  for (std::string& key : ended) put({std::move(key), time_s, "null"});
  for (const Message& message : messages) put(message);
}

std::vector<std::shared_ptr<const Posted>> Board::after(std::uint64_t sequence) const {
  std::vector<std::shared_ptr<const Posted>> out;
  for (auto next = order_.upper_bound(sequence); next != order_.end(); ++next)
    out.push_back(by_key_.find(next->second)->second);
  return out;
}

}  // namespace tutti::page
