// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace tutti {

/// A set of numbers that come mostly one after the other, in memory that grows with its gaps, not with the numbers.
class NumberSet {
 public:
  struct Stretch {  ///< Numbers begin ... end - 1.
    std::uint64_t begin = 0;
    std::uint64_t end = 0;
    friend bool operator==(const Stretch&, const Stretch&) = default;
  };

  /// Again changes nothing. Not the largest number of 64 bits.
  void insert(std::uint64_t number);
  /// One that is not in it changes nothing.
  void erase(std::uint64_t number);
  [[nodiscard]] bool contains(std::uint64_t number) const;
  /// The first number, counted from 0, that is not in it.
  [[nodiscard]] std::uint64_t watermark() const;
  /// Ascending, not empty, neither overlapping nor touching. One that begins at 0 ends at the watermark.
  [[nodiscard]] const std::vector<Stretch>& stretches() const { return stretches_; }
  /// Behind what is in it: not empty, neither overlapping nor touching that; otherwise false, and nothing changes.
  bool append(Stretch stretch);
  void clear() { stretches_.clear(); }
  friend bool operator==(const NumberSet&, const NumberSet&) = default;

 private:
  std::vector<Stretch> stretches_;
};

}  // namespace tutti
