// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "tutti/base/number_set.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::server {

/// Which pairs of submaps need not be asked any more, in memory that grows with the submaps, not with their pairs.
/// Submaps are numbered in the order in which they came. Of every one it is known up to which number it has been
/// compared with all (its watermark), and which stretches of numbers beyond have been answered out of turn. A pair
/// belongs to the submap that came later, whose watermark ends at its own number.
class AnsweredPairs {
 public:
  /// Submaps that are there already stay where they are.
  void add_submap(SubmapId id);
  /// Both submaps have been added.
  [[nodiscard]] bool has_both(const SubmapPair& pair) const;
  /// Both submaps have been added. False: it was there.
  bool insert(const SubmapPair& pair);
  [[nodiscard]] bool contains(const SubmapPair& pair) const;
  /// Those that are not in it, the smaller submap first, in the order of their ids. Takes time for these and for the
  /// submaps, not for all pairs.
  [[nodiscard]] std::vector<SubmapPair> open() const;
  /// No pair is answered any more; the submaps stay.
  void forget_answers();

  /// How many submaps, counted from the first that came, this one has been compared with without a gap.
  [[nodiscard]] std::size_t watermark(SubmapId id) const;
  /// Stretches beyond the watermarks, of all submaps together.
  [[nodiscard]] std::size_t stretches_beyond() const;
  friend bool operator==(const AnsweredPairs&, const AnsweredPairs&) = default;

 private:
  struct Place {
    std::uint32_t later = 0;
    std::uint32_t earlier = 0;
  };
  [[nodiscard]] Place place_of(const SubmapPair& pair) const;

  std::unordered_map<SubmapId, std::uint32_t> number_;
  std::vector<NumberSet> answered_;  ///< By number.
};

}  // namespace tutti::server
