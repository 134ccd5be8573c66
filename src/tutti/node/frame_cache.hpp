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

/// Frames of submaps, of which those used last are kept. May be called from several threads.
class FrameCache {
 public:
  explicit FrameCache(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void put(SubmapId id, std::string frame);
  [[nodiscard]] bool contains(SubmapId id) const;
  [[nodiscard]] Result<std::string> get(SubmapId id) const;
  /// Drops those used longest ago until the rest fits; but none of `needed`, whatever they take.
  void trim(const std::set<SubmapId>& needed);
  [[nodiscard]] std::size_t bytes() const;

 private:
  struct Entry {
    std::string frame;
    mutable std::uint64_t used = 0;  // larger: later
  };
  std::size_t max_bytes_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::uint64_t uses_ = 0;
  std::size_t bytes_ = 0;
  std::map<SubmapId, Entry> entries_;
};

}  // namespace tutti::node
