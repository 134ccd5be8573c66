// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <list>
#include <memory>
#include <utility>

#include "tutti/base/ids.hpp"

namespace tutti::mission {

/// Something about each of the few submaps that were used last.
template <class Value>
class RecentlyUsed {
 public:
  explicit RecentlyUsed(std::size_t at_most) : at_most_(at_most) {}

  /// Null if it is not here.
  std::shared_ptr<const Value> find(SubmapId id) {
    const auto found = std::ranges::find(entries_, id, &Entry::first);
    if (found == entries_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found);
    return found->second;
  }
  /// What was here is replaced.
  void keep(SubmapId id, std::shared_ptr<const Value> value) {
    std::erase_if(entries_, [&](const Entry& entry) { return entry.first == id; });
    entries_.emplace_front(id, std::move(value));
    if (entries_.size() > at_most_) entries_.pop_back();
  }

 private:
  using Entry = std::pair<SubmapId, std::shared_ptr<const Value>>;
  std::size_t at_most_;
  std::list<Entry> entries_;  // the last used first
};

}  // namespace tutti::mission
