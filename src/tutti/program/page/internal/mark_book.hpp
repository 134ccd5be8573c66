// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <mutex>
#include <string>
#include <utility>

#include "tutti/mapfile/marks.hpp"

namespace tutti::page {

/// The marks of a running mission's map. May be called from several threads.
class MarkBook {
 public:
  explicit MarkBook(storage::TableStore& map) : map_(map) {}

  /// All marks that the map's store has; must be called first.
  Result<MarkSet> open() {
    const std::scoped_lock lock(mutex_);
    auto stored = mapfile::read_marks(map_);
    if (stored) marks_ = *stored;
    return stored;
  }
  /// The mark as it is stored, when this returns.
  Result<MarkSet::value_type> add(MapMark mark, const std::string& photo) {
    const std::scoped_lock lock(mutex_);
    const auto number = mapfile::put_mark(map_, marks_, mark, photo);
    if (!number) return tl::unexpected(number.error());
    return *marks_.emplace(*number, std::move(mark)).first;
  }
  Status remove(std::uint64_t number) {
    const std::scoped_lock lock(mutex_);
    if (!marks_.contains(number)) return fail(ErrorCode::invalid, "there is no such mark");
    if (Status ok = mapfile::remove_mark(map_, number); !ok) return ok;
    marks_.erase(number);
    return {};
  }

 private:
  std::mutex mutex_;
  storage::TableStore& map_;
  MarkSet marks_;
};

}  // namespace tutti::page
