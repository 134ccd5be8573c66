// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/place_index.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "tutti/base/check.hpp"
#include "tutti/base/random.hpp"
#include "tutti/perception/visual/hamming.hpp"

namespace tutti::visual {

PlaceIndex::PlaceIndex(DescriptorKind kind, std::uint32_t words, const PlaceIndexConfig& config)
    : config_(config), rows_{.kind = kind, .words = words} {
  const std::uint32_t bits = 64 * words;
  TUTTI_CHECK(words > 0 && config.key_bits <= 28 && static_cast<std::uint32_t>(config.key_bits) <= bits,
              "keys of {} bits of {}", config.key_bits, bits);
  Rng rng(words);
  for (int t = 0; t < config.tables; ++t) {
    std::vector<std::uint16_t> all(bits);
    std::iota(all.begin(), all.end(), std::uint16_t{0});
    for (std::size_t i = 0; i < static_cast<std::size_t>(config.key_bits); ++i)
      std::swap(all[i], all[i + rng.index(bits - i)]);
    all.resize(static_cast<std::size_t>(config.key_bits));
    tables_.push_back({std::move(all), std::vector<std::uint32_t>(std::size_t{1} << config.key_bits, kNoIndex), {}});
  }
}

std::size_t PlaceIndex::key(const Table& table, std::span<const std::uint64_t> row) {
  std::size_t out = 0;
  for (const std::uint16_t bit : table.bits) out = (out << 1U) | ((row[bit / 64U] >> (bit % 64U)) & 1U);
  return out;
}

void PlaceIndex::check_kind(const Descriptors& descriptors) const {
  TUTTI_CHECK(descriptors.size() == 0 || (descriptors.kind == rows_.kind && descriptors.words == rows_.words),
              "descriptors of another kind than the index's");
}

void PlaceIndex::add(const SubmapId& submap, const KeyframeId& keyframe, const Descriptors& descriptors) {
  check_kind(descriptors);
  const auto place = static_cast<std::uint32_t>(places_.size());
  places_.push_back({submap, keyframe});
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    const auto row = static_cast<std::uint32_t>(place_of_row_.size());
    place_of_row_.push_back(place);
    for (Table& table : tables_) {
      std::uint32_t& first = table.first[key(table, descriptors.row(i))];
      table.next.push_back(first);
      first = row;
    }
  }
  rows_.bits.insert(rows_.bits.end(), descriptors.bits.begin(), descriptors.bits.end());
}

std::vector<double> PlaceIndex::own_votes(const Descriptors& descriptors) const {
  const auto most = static_cast<std::uint32_t>(config_.max_hamming * 64.0 * rows_.words);
  std::vector<double> votes(places_.size(), 0.0);
  std::vector<std::size_t> voted_by(places_.size(), descriptors.size());
  std::vector<std::uint32_t> hit;  // places that one descriptor votes for, each once
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    const auto query = descriptors.row(i);
    hit.clear();
    for (const Table& table : tables_) {
      std::uint32_t row = table.first[key(table, query)];
      for (int n = 0; n < config_.max_bucket && row != kNoIndex; ++n, row = table.next[row]) {
        const std::uint32_t place = place_of_row_[row];
        if (voted_by[place] == i || hamming_distance(query, rows_.row(row)) > most) continue;
        voted_by[place] = i;
        hit.push_back(place);
      }
    }
    const double weight = std::log(static_cast<double>(places_.size() + 1) / static_cast<double>(hit.size() + 1));
    for (const std::uint32_t place : hit) votes[place] += weight;
  }
  return votes;
}

std::vector<PlaceVotes> PlaceIndex::query(const Descriptors& descriptors, std::size_t most) const {
  check_kind(descriptors);
  const auto own = own_votes(descriptors);
  std::vector<PlaceVotes> out;
  for (std::size_t p = 0; p < places_.size(); ++p) {
    PlaceVotes place = places_[p];
    place.votes = own[p];
    if (p > 0 && places_[p - 1].submap == place.submap) place.votes += own[p - 1];
    if (p + 1 < places_.size() && places_[p + 1].submap == place.submap) place.votes += own[p + 1];
    if (place.votes > 0.0) out.push_back(place);
  }
  const auto last = out.begin() + static_cast<std::ptrdiff_t>(std::min(most, out.size()));
  std::ranges::partial_sort(out, last, [](const PlaceVotes& a, const PlaceVotes& b) {
    return a.votes != b.votes ? a.votes > b.votes : a.keyframe < b.keyframe;
  });
  out.erase(last, out.end());
  return out;
}

}  // namespace tutti::visual
