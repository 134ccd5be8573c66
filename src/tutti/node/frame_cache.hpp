// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"

namespace tutti::node {

/// A worker's cache of submaps' frames, which keeps the newest submaps. Every new submap is compared with all others in
/// turn, so keeping the last used ones would hardly ever help. The age of a submap is that of its first put(). May be
/// called from several threads.
class FrameCache {
 public:
  explicit FrameCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  /// Keeps a frame, replacing an earlier one of this submap.
  void put(SubmapId id, std::string frame);
  [[nodiscard]] bool contains(SubmapId id) const;
  /// The frame; fails with ErrorCode::io when the cache does not have it.
  [[nodiscard]] Result<std::string> get(SubmapId id) const;
  /// Drops the oldest submaps until the rest fits into max_bytes, but none of `needed`.
  void trim(const std::set<SubmapId>& needed);
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t max_bytes_;
  mutable std::mutex mutex_;                // guards what follows
  std::map<SubmapId, std::uint64_t> ages_;  // of all submaps that ever came; larger is newer
  std::size_t bytes_ = 0;
  std::map<SubmapId, std::string> frames_;
};

}  // namespace tutti::node
