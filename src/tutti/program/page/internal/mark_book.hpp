// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <optional>
#include <utility>

#include "tutti/model/map_mark.hpp"

namespace tutti::page {

/// The marks of a running mission's map: those in its file, and what the server has just stored or removed there.
class MarkBook {
 public:
  /// `stored` are those in the file, which may have been read before the server's last answer. All that there are.
  MarkSet replace(const MarkSet& stored) {
    marks_ = stored;
    for (auto change = changes_.begin(); change != changes_.end();) {
      const auto& [number, mark] = *change;
      const auto found = stored.find(number);
      const bool is_read = mark ? found != stored.end() : found == stored.end();
      if (mark && !is_read) marks_.insert_or_assign(number, *mark);
      if (!mark && !is_read) marks_.erase(number);
      change = is_read ? changes_.erase(change) : std::next(change);
    }
    return marks_;
  }
  /// The server has stored it, or removed it.
  void note(std::uint64_t number, const std::optional<MapMark>& mark) {
    changes_.insert_or_assign(number, mark);
    if (mark) marks_.insert_or_assign(number, *mark);
    if (!mark) marks_.erase(number);
  }
  /// One that no mark has, from `wanted` on.
  [[nodiscard]] std::uint64_t free_number(std::uint64_t wanted) const {
    while (marks_.contains(wanted)) ++wanted;
    return wanted;
  }
  [[nodiscard]] bool contains(std::uint64_t number) const { return marks_.contains(number); }

 private:
  MarkSet marks_;
  std::map<std::uint64_t, std::optional<MapMark>> changes_;  // that were not read yet
};

}  // namespace tutti::page
