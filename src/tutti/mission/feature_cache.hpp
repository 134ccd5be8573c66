// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"
#include "tutti/perception/lidar/submap_features.hpp"

namespace tutti::mission {

/// Features of the newest submaps, as many as fit into a budget of bytes. Every new submap meets all others in turn: by
/// the time an old one is wanted again all the others were, so that of those used last hardly any would be there. Those
/// kept by their own age are there every time, and a new one always finds room. Safe to call from several threads.
class FeatureCache {
 public:
  using Features = std::shared_ptr<const lidar::SubmapFeatures>;

  explicit FeatureCache(std::size_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// What is kept, or else what `compute` makes of it, once for all threads that ask meanwhile. A submap is as old as
  /// the first call that names it.
  Result<Features> get(SubmapId id, const std::function<Result<Features>()>& compute);
  [[nodiscard]] std::size_t held_bytes() const;  ///< Never more than the budget.

 private:
  using Age = std::size_t;  // counts up
  struct Entry {
    Features features;
    std::size_t bytes = 0;
  };
  void keep(Age age, const Features& features);  // under the lock

  std::size_t budget_bytes_;
  mutable std::mutex mutex_;  // guards everything below
  std::size_t held_bytes_ = 0;
  std::unordered_map<SubmapId, Age> ages_;  // of all submaps ever asked for
  std::map<Age, Entry> entries_;
  std::map<Age, std::shared_future<Result<Features>>> under_way_;
};

}  // namespace tutti::mission
