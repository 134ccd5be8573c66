// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/frame_cache.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace tutti::node {

void FrameCache::put(SubmapId id, std::string frame) {
  const std::scoped_lock lock(mutex_);
  ages_.try_emplace(id, ages_.size());
  std::string& kept = frames_[id];
  bytes_ += frame.size() - kept.size();
  kept = std::move(frame);
}

bool FrameCache::contains(SubmapId id) const {
  const std::scoped_lock lock(mutex_);
  return frames_.contains(id);
}

Result<std::string> FrameCache::get(SubmapId id) const {
  const std::scoped_lock lock(mutex_);
  const auto found = frames_.find(id);
  if (found == frames_.end()) return fail(ErrorCode::io, "submap {} has not come from the server", to_string(id));
  return found->second;
}

void FrameCache::trim(const std::set<SubmapId>& needed) {
  const std::scoped_lock lock(mutex_);
  if (bytes_ <= max_bytes_) return;
  std::vector<std::pair<std::uint64_t, SubmapId>> oldest;
  for (const auto& [id, frame] : frames_)
    if (!needed.contains(id)) oldest.emplace_back(ages_.at(id), id);
  std::ranges::sort(oldest);
  for (const auto& [age, id] : oldest) {
    if (bytes_ <= max_bytes_) return;
    bytes_ -= frames_.at(id).size();
    frames_.erase(id);
  }
}

std::size_t FrameCache::bytes() const {
  const std::scoped_lock lock(mutex_);
  return bytes_;
}

}  // namespace tutti::node
