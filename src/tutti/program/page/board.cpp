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

bool Board::put(Message message) {
  auto [found, is_new] = by_key_.try_emplace(message.key);
  Entry& entry = found->second;
  if (!is_new && entry.message->value == message.value) return false;
  if (!is_new) order_.erase(entry.sequence);
  entry.sequence = ++sequence_;
  order_.emplace(sequence_, message.key);
  entry.message = std::make_shared<const Message>(std::move(message));
  return true;
}

/// What has ended stays as "null": a page that was away is to hear of it.
void Board::put_all(std::string_view prefix, std::vector<Message> messages, double time_s) {
  std::set<std::string, std::less<>> keys;
  for (const Message& message : messages) keys.insert(message.key);
  std::vector<std::string> ended;
  for (auto entry = by_key_.lower_bound(prefix); entry != by_key_.end() && entry->first.starts_with(prefix); ++entry)
    if (!keys.contains(entry->first)) ended.push_back(entry->first);
  for (std::string& key : ended) put({std::move(key), time_s, "null"});
  for (Message& message : messages) put(std::move(message));
}

std::vector<std::shared_ptr<const Message>> Board::after(std::uint64_t sequence) const {
  std::vector<std::shared_ptr<const Message>> out;
  for (auto next = order_.upper_bound(sequence); next != order_.end(); ++next)
    out.push_back(by_key_.find(next->second)->second.message);
  return out;
}

}  // namespace tutti::page
