// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "tutti/base/number_set.hpp"
#include "tutti/model/loop_closure.hpp"

namespace tutti::server {

/// The pairs of submaps that need not be verified any more, in memory that grows with the submaps and not with their
/// pairs. Submaps are numbered in order of arrival. For each one the set keeps up to which number it was compared with
/// all others (its watermark), and the intervals of numbers beyond that were answered out of turn. A pair belongs to
/// the submap that came later, so that submap's watermark ends at its own number.
class AnsweredPairs {
 public:
  /// Adds a submap; one that is known already keeps its number.
  void add_submap(SubmapId id);
  /// True if both submaps were added.
  [[nodiscard]] bool has_both(const SubmapPair& pair) const;
  /// Adds a pair, of which both submaps must have been added. False when the set has it already.
  bool insert(const SubmapPair& pair);
  /// Adds the pairs of this submap with all that came before it, except with `open` (in any order), whose answers stay
  /// as they are.
  void insert_all_but(SubmapId id, std::span<const SubmapId> open);
  [[nodiscard]] bool contains(const SubmapPair& pair) const;
  /// True if it has any pair of this submap with one that came before it.
  [[nodiscard]] bool has_any(SubmapId id) const { return !answered_[number_.at(id)].intervals().empty(); }
  /// The pairs of this submap with those that came before it that are not in the set, smaller submap first, in order of
  /// their arrival. Takes time in proportion to these pairs.
  [[nodiscard]] std::vector<SubmapPair> open(SubmapId id) const;
  /// Removes all pairs; the submaps stay.
  void forget_answers();

  /// With how many submaps, counted in order of arrival, this one was compared without a gap.
  [[nodiscard]] std::size_t watermark(SubmapId id) const;
  /// Number of intervals beyond the watermarks, over all submaps.
  [[nodiscard]] std::size_t intervals_beyond() const;
  friend bool operator==(const AnsweredPairs&, const AnsweredPairs&) = default;

 private:
  struct Place {
    std::uint32_t later = 0;
    std::uint32_t earlier = 0;
  };
  [[nodiscard]] Place place_of(const SubmapPair& pair) const;

  std::unordered_map<SubmapId, std::uint32_t> number_;
  std::vector<SubmapId> ids_;        ///< By number.
  std::vector<NumberSet> answered_;  ///< Per submap, by its number: the earlier ones that it was compared with.
};

}  // namespace tutti::server
