// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>
#include <vector>

namespace tutti {

/// Groups the elements 0 .. count - 1 by joining pairs: union-find with path halving.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
  }
  /// Makes one set of the sets of `a` and `b`; false if they were one set before.
  bool join(std::size_t a, std::size_t b) {
    const auto [low, high] = std::minmax({root(a), root(b)});
    parent_[high] = low;
    return low != high;
  }
  /// Per element the number of its set, sets being numbered 0, 1, ... in the order of their first elements; and the
  /// number of sets.
  [[nodiscard]] std::pair<std::vector<int>, int> labels() {
    std::vector<int> label(parent_.size());
    int count = 0;
    for (std::size_t i = 0; i < parent_.size(); ++i) label[i] = parent_[i] == i ? count++ : label[root(i)];
    return {std::move(label), count};
  }

 private:
  std::size_t root(std::size_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;  // the first member
  }
  std::vector<std::size_t> parent_;
};

}  // namespace tutti
