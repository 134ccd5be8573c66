// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/acknowledged.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "tutti/program/field_json.hpp"

namespace tutti::page {
namespace {

std::string key_of(const std::string& id, double since_s) {
  return fmt::format("acknowledged/{}@{}", id, std::llround(since_s));
}

}  // namespace

void Acknowledged::resume(const Message& message) {
  if (history::kind_of(message.key) == "acknowledged" && keys_.insert(message.key).second)
    order_.push_back(message.key);
}

void Acknowledged::show(const std::vector<Alert>& alerts) {
  since_s_.clear();
  for (const Alert& alert : alerts) since_s_[alert.id] = alert.since_s;
}

Result<std::vector<Message>> Acknowledged::acknowledge(const std::vector<std::string>& ids, bool undo,
                                                       const std::string& by, double time_s) {
  if (ids.size() > kMostAtOnce)
    return fail(ErrorCode::invalid, "alerts: {} of them, expected at most {}", ids.size(), kMostAtOnce);
  std::vector<Message> out;
  for (const std::string& id : ids) {
    const auto alert = since_s_.find(id);
    if (alert == since_s_.end()) continue;
    const std::string key = key_of(id, alert->second);
    if (undo) {
      if (keys_.erase(key) > 0) std::erase(order_, key);
      out.push_back({key, time_s, "null"});
      continue;
    }
    if (keys_.insert(key).second) order_.push_back(key);
    out.push_back({key, time_s, text_of(FieldJson{{"alert", id}, {"since_s", alert->second}, {"by", by}})});
  }
  if (out.empty()) return fail(ErrorCode::invalid, "alerts: none of these is there now, expected ids of alerts");
  for (; order_.size() > kMost; order_.pop_front()) {
    keys_.erase(order_.front());
    out.push_back({order_.front(), time_s, "null"});
  }
  return out;
}

}  // namespace tutti::page
