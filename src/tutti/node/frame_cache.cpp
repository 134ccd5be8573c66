// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/frame_cache.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace tutti::node {

void FrameCache::put(SubmapId id, std::string frame) {
  const std::scoped_lock lock(mutex_);
  Entry& entry = entries_[id];
  bytes_ += frame.size() - entry.frame.size();
  entry = {std::move(frame), ++uses_};
}

bool FrameCache::contains(SubmapId id) const {
  const std::scoped_lock lock(mutex_);
  return entries_.contains(id);
}

Result<std::string> FrameCache::get(SubmapId id) const {
  const std::scoped_lock lock(mutex_);
  const auto found = entries_.find(id);
  if (found == entries_.end()) return fail(ErrorCode::io, "submap {} has not come from the server", to_string(id));
  found->second.used = ++uses_;
  return found->second.frame;
}

void FrameCache::trim(const std::set<SubmapId>& needed) {
  const std::scoped_lock lock(mutex_);
  if (bytes_ <= max_bytes_) return;
  std::vector<std::pair<std::uint64_t, SubmapId>> oldest;
  for (const auto& [id, entry] : entries_)
    if (!needed.contains(id)) oldest.emplace_back(entry.used, id);
  std::ranges::sort(oldest);
  for (const auto& [used, id] : oldest) {
    if (bytes_ <= max_bytes_) return;
    bytes_ -= entries_.at(id).frame.size();
    entries_.erase(id);
  }
}

std::size_t FrameCache::bytes() const {
  const std::scoped_lock lock(mutex_);
  return bytes_;
}

}  // namespace tutti::node
