// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tutti {

/// A set of numbers of which most follow each other, such as the submaps that have arrived: its memory grows with the
/// gaps, not with the numbers.
class NumberSet {
 public:
  struct Interval {  ///< Numbers begin ... end - 1.
    std::uint64_t begin = 0;
    std::uint64_t end = 0;
    friend bool operator==(const Interval&, const Interval&) = default;
  };

  /// A number that is in the set already changes nothing. The largest number of 64 bits cannot be stored.
  void insert(std::uint64_t number);
  /// A number that is not in the set changes nothing.
  void erase(std::uint64_t number);
  [[nodiscard]] bool contains(std::uint64_t number) const;
  /// The smallest number that is not in the set.
  [[nodiscard]] std::uint64_t watermark() const;
  /// The set as intervals, ascending, none empty, none overlapping or touching another.
  [[nodiscard]] const std::vector<Interval>& intervals() const { return intervals_; }
  /// Adds an interval that is not empty and begins at least one number behind the last one; otherwise returns false and
  /// changes nothing.
  bool append(Interval interval);
  void clear() { intervals_.clear(); }
  friend bool operator==(const NumberSet&, const NumberSet&) = default;

 private:
  std::vector<Interval> intervals_;
};

}  // namespace tutti
