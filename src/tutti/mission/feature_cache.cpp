// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/feature_cache.hpp"

namespace tutti::mission {

Result<FeatureCache::Features> FeatureCache::get(SubmapId id, const std::function<Result<Features>()>& compute) {
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
  Result<Features> made = compute();
  promise.set_value(made);
  const std::lock_guard lock(mutex_);
  under_way_.erase(age);
  if (made) keep(age, *made);
  return made;
}

void FeatureCache::keep(Age age, const Features& features) {
  const std::size_t bytes = lidar::bytes_of(*features);
  if (bytes > budget_bytes_) return;
  entries_[age] = {features, bytes};
  for (held_bytes_ += bytes; held_bytes_ > budget_bytes_; entries_.erase(entries_.begin()))
    held_bytes_ -= entries_.begin()->second.bytes;
}

std::size_t FeatureCache::held_bytes() const {
  const std::lock_guard lock(mutex_);
  return held_bytes_;
}

}  // namespace tutti::mission
