// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <exception>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <unordered_map>

#include "tutti/base/ids.hpp"
#include "tutti/base/result.hpp"

namespace tutti::verifiers {

/// Keeps the features of the newest submaps that fit into a budget of bytes; F is their type, and bytes_of(const F&), a
/// function beside it, is their size. Every new submap is compared with all others in turn; keeping the last used
/// features would hardly ever help, while the newest submaps' features are found every time. May be called from several
/// threads.
template <class F>
class FeatureCache {
 public:
  using Features = std::shared_ptr<const F>;

  explicit FeatureCache(std::size_t budget_bytes) : budget_bytes_(budget_bytes) {}

  /// The features of a submap: kept ones, or else what `compute` returns, which is called once for all threads that ask
  /// meanwhile. The age of a submap is that of the first call for it. Exceptions of `compute` are passed on.
  Result<Features> get(SubmapId id, const std::function<Result<Features>()>& compute);
  [[nodiscard]] std::size_t cached_bytes() const;  ///< Never more than the budget.

 private:
  using Age = std::size_t;  // counts up
  struct Entry {
    Features features;
    std::size_t bytes = 0;
  };
  void keep(Age age, const Features& features);  // called with the lock held

  std::size_t budget_bytes_;
  mutable std::mutex mutex_;  // guards everything below
  std::size_t cached_bytes_ = 0;
  std::unordered_map<SubmapId, Age> ages_;  // of all submaps ever asked for
  std::map<Age, Entry> entries_;
  std::map<Age, std::shared_future<Result<Features>>> under_way_;
};

template <class F>
auto FeatureCache<F>::get(SubmapId id, const std::function<Result<Features>()>& compute) -> Result<Features> {
  std::promise<Result<Features>> promise;
  Age age = 0;
  {
    std::unique_lock lock(mutex_);
    age = ages_.try_emplace(id, ages_.size()).first->second;
    if (const auto kept = entries_.find(age); kept != entries_.end()) return kept->second.features;
    if (const auto other = under_way_.find(age); other != under_way_.end()) {
      const auto made = other->second;
      lock.unlock();
      return made.get();
    }
    under_way_.emplace(age, promise.get_future().share());
  }
  Result<Features> made;
  try {
    made = compute();
  } catch (...) {  // for all who ask meanwhile; the next who asks computes again
    promise.set_exception(std::current_exception());
    const std::lock_guard lock(mutex_);
    under_way_.erase(age);
    throw;
  }
  promise.set_value(made);
  const std::lock_guard lock(mutex_);
  under_way_.erase(age);
  if (made) keep(age, *made);
  return made;
}

template <class F>
void FeatureCache<F>::keep(Age age, const Features& features) {
  const std::size_t bytes = bytes_of(*features);
  if (bytes > budget_bytes_) return;
  entries_[age] = {features, bytes};
  for (cached_bytes_ += bytes; cached_bytes_ > budget_bytes_; entries_.erase(entries_.begin()))
    cached_bytes_ -= entries_.begin()->second.bytes;
}

template <class F>
std::size_t FeatureCache<F>::cached_bytes() const {
  const std::lock_guard lock(mutex_);
  return cached_bytes_;
}

}  // namespace tutti::verifiers
