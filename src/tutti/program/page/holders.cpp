// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/page/holders.hpp"

#include "tutti/program/field_json.hpp"

namespace tutti::page {

void Holders::expire(double now_s) {
  std::erase_if(by_name_, [&](const auto& entry) { return entry.second.until_s <= now_s; });
}

Status Holders::hold(const std::string& by, const std::string& what, double now_s) {
  expire(now_s);
  if (by.empty()) return fail(ErrorCode::invalid, "by: expected a name");
  if (what.empty()) return by_name_.erase(by), Status();
  if (what.size() > kLongest || !(what.starts_with("closure/") || what.starts_with("robot/")))
    return fail(ErrorCode::invalid, "what: expected closure/NAME or robot/NUMBER");
  if (by_name_.size() >= kMost && !by_name_.contains(by))
    return fail(ErrorCode::invalid, "{} others hold something already", by_name_.size());
  by_name_[by] = {what, now_s + kHold_s};
  return {};
}

Message Holders::message(double now_s, double time_s) {
  expire(now_s);
  FieldJson out = FieldJson::array();
  for (const auto& [by, held] : by_name_) out.push_back({{"by", by}, {"what", held.what}});
  return {"held", time_s, text_of(out)};
}

}  // namespace tutti::page
