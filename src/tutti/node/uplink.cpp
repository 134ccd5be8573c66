// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/uplink.hpp"

#include <algorithm>
#include <ranges>

namespace tutti::node {

void Uplink::add(SubmapId submap, std::size_t bytes) {
  if (bytes_.emplace(submap, bytes).second) all_bytes_ += bytes;
}

bool Uplink::remove(SubmapId submap) {
  const auto found = bytes_.find(submap);
  if (found == bytes_.end()) return false;
  all_bytes_ -= found->second;
  if (sent_.erase(submap) > 0) under_way_bytes_ -= found->second;
  bytes_.erase(found);
  parked_.erase(submap);
  return true;
}

void Uplink::park(SubmapId submap) {
  if (sent_.contains(submap)) hold(submap);
}

void Uplink::hold(SubmapId submap) {
  const auto known = bytes_.find(submap);
  if (known == bytes_.end()) return;
  if (sent_.erase(submap) > 0) under_way_bytes_ -= known->second;
  parked_.insert(submap);
}

/// One at least, however large.
bool Uplink::has_room_for(std::size_t bytes) const {
  return config_.max_under_way_bytes == 0 || under_way_bytes_ == 0 ||
         under_way_bytes_ + bytes <= config_.max_under_way_bytes;
}

std::vector<SubmapId> Uplink::take(Timestamp now) {
  std::vector<SubmapId> taken;
  bool is_full = false;  // then older ones do not overtake the newest that waits
  for (const auto& [submap, bytes] : std::views::reverse(bytes_)) {
    if (now < free_at_) break;
    if (parked_.contains(submap)) continue;
    const auto sent = sent_.find(submap);
    const bool is_under_way = sent != sent_.end();
    if (is_under_way && now < sent->second + kAgain_s) continue;
    is_full = is_full || (!is_under_way && !has_room_for(bytes));
    if (!is_under_way && is_full) continue;
    if (!is_under_way) under_way_bytes_ += bytes;
    sent_.insert_or_assign(submap, now);
    if (config_.bytes_per_s > 0.0) free_at_ = now + static_cast<double>(bytes) / config_.bytes_per_s;
    taken.push_back(submap);
  }
  return taken;
}

std::optional<Timestamp> Uplink::next() const {
  std::optional<Timestamp> next;
  const auto consider = [&](Timestamp t) { next = next ? std::min(*next, t) : t; };
  for (const auto& [submap, sent] : sent_) consider(std::max(free_at_, sent + kAgain_s));
  for (const auto& [submap, bytes] : std::views::reverse(bytes_)) {
    if (sent_.contains(submap) || parked_.contains(submap)) continue;
    if (has_room_for(bytes)) consider(free_at_);
    break;  // the newest that waits
  }
  return next;
}

}  // namespace tutti::node
