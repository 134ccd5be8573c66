// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/ids.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::visual {

struct PlaceIndexConfig {
  int tables = 8;             ///< More find more of the descriptors that differ, and cost as much more.
  int key_bits = 20;          ///< Of a table: about as many entries as there are descriptors, to the power of two.
  int max_bucket = 32;        ///< Descriptors of one key that are looked at, newest first.
  double max_hamming = 0.16;  ///< Of a vote, as a share of the bits.
  template <class V>
  void describe(V& v) {
    v.field("tables", tables, between(1, 64), "Hash tables: more find more, and cost more.");
    v.field("key_bits", key_bits, between(4, 28), "Bits of the descriptors that make a table's key.");
    v.field("max_bucket", max_bucket, at_least(1), "Descriptors of one key that are looked at.");
    v.field("max_hamming", max_hamming, between(0.0, 1.0), "Bits in which a vote may differ, as a share of all.");
  }
};

/// A keyframe that looks like the one asked about.
struct PlaceVotes {
  SubmapId submap;
  KeyframeId keyframe;
  double votes = 0.0;  ///< Its own and those of the keyframes beside it in its submap, which see much the same.
};

/// The descriptors of all robots' keyframes in one matrix. A query votes for the keyframes that have a descriptor near
/// one of its own; a vote counts the more the fewer keyframes it goes to (log of the inverse share). Near ones are
/// found by hash tables over random choices of bits (Indyk and Motwani 1998), distances are exact. The choice is always
/// the same, so the answer depends on what was added and in what order alone.
class PlaceIndex {
 public:
  PlaceIndex(DescriptorKind kind, std::uint32_t words, const PlaceIndexConfig& config = {});

  /// A submap's keyframes one after the other. The descriptors are of the index's kind (checked), or there are none.
  void add(const SubmapId& submap, const KeyframeId& keyframe, const Descriptors& descriptors);
  /// Best first, at most `most`, without those that nothing votes for.
  [[nodiscard]] std::vector<PlaceVotes> query(const Descriptors& descriptors, std::size_t most) const;
  [[nodiscard]] std::size_t size() const { return places_.size(); }

 private:
  struct Table {
    std::vector<std::uint16_t> bits;   // which make the key
    std::vector<std::uint32_t> first;  // row of each key, or kNoIndex
    std::vector<std::uint32_t> next;   // of each row, the next one of its key
  };
  [[nodiscard]] static std::size_t key(const Table& table, std::span<const std::uint64_t> row);
  void check_kind(const Descriptors& descriptors) const;
  [[nodiscard]] std::vector<double> own_votes(const Descriptors& descriptors) const;

  PlaceIndexConfig config_;
  Descriptors rows_;
  std::vector<std::uint32_t> place_of_row_;
  std::vector<PlaceVotes> places_;  // without votes
  std::vector<Table> tables_;
};

}  // namespace tutti::visual
