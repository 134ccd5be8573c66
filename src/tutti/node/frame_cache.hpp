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

/// Frames of submaps, of which the newest are kept: every new submap meets all others in turn, and of those used last
/// hardly any would be there when they are wanted again. A submap is as old as the first put() of it. May be called
/// from several threads.
class FrameCache {
 public:
  explicit FrameCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void put(SubmapId id, std::string frame);
  [[nodiscard]] bool contains(SubmapId id) const;
  [[nodiscard]] Result<std::string> get(SubmapId id) const;
  /// Drops the oldest until the rest fits; but none of `needed`, whatever they take.
  void trim(const std::set<SubmapId>& needed);
  [[nodiscard]] std::size_t bytes() const;

 private:
  std::size_t max_bytes_;
  mutable std::mutex mutex_;                // guards what follows
  std::map<SubmapId, std::uint64_t> ages_;  // of all that have ever come; larger: newer
  std::size_t bytes_ = 0;
  std::map<SubmapId, std::string> frames_;
};

}  // namespace tutti::node
