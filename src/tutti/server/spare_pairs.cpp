// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/spare_pairs.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::server {
namespace {

std::uint64_t place_in_line(const SubmapPair& pair) {
  std::uint64_t place = 0x9e3779b97f4a7c15ULL;
  for (const SubmapId& id : {pair.first, pair.second}) place = mixed(place + packed(id.chain, id.index));
  return place;
}

/// The closures of one submap with one chain.
using Line = std::pair<SubmapId, ChainId>;

std::array<Line, 2> lines_of(const SubmapPair& pair) {
  return {Line{pair.first, pair.second.chain}, Line{pair.second, pair.first.chain}};
}

/// A pair and its place in line.
using Placed = std::pair<std::uint64_t, SubmapPair>;

std::vector<Placed> closed_pairs(const VerdictSet& verdicts, const SubmapSet& submaps) {
  std::vector<Placed> out;
  for (const auto& [pair, verdict] : verdicts)
    if (!verdict.closures.empty() && has_both(submaps, pair)) out.emplace_back(place_in_line(pair), pair);
  std::ranges::sort(out);
  return out;
}

/// Per pair how many earlier ones it has with the other's chain, at the end that has fewer.
std::vector<std::size_t> earlier_with_chain(const std::vector<Placed>& in_line) {
  std::vector<std::size_t> out;
  std::map<Line, std::size_t> before;
  for (const auto& [place, pair] : in_line) {
    const auto [first, second] = lines_of(pair);
    out.push_back(std::min(before[first]++, before[second]++));
  }
  return out;
}

/// Per pair how many earlier ones it has with all chains, which take turns, at the end that has fewer.
std::vector<std::size_t> earlier_with_all(const std::vector<Placed>& in_line) {
  std::map<Line, std::size_t> before;
  std::map<SubmapId, std::vector<std::pair<std::size_t, std::size_t>>> turns;  // turn, number in line
  for (std::size_t k = 0; k < in_line.size(); ++k)
    for (const Line& line : lines_of(in_line[k].second)) turns[line.first].emplace_back(before[line]++, k);
  std::vector<std::size_t> out(in_line.size(), in_line.size());
  for (auto& [submap, of_submap] : turns) {
    std::ranges::sort(of_submap);
    for (std::size_t rank = 0; rank < of_submap.size(); ++rank) {
      std::size_t& least = out[of_submap[rank].second];
      least = std::min(least, rank);
    }
  }
  return out;
}

/// How many pairs of a submap are left where no more than `most` are in all, which are fewer than there are.
std::size_t pairs_per_submap(std::vector<std::size_t> earlier, std::size_t most) {
  const auto first_too_many = earlier.begin() + static_cast<std::ptrdiff_t>(most);
  std::ranges::nth_element(earlier, first_too_many);
  return std::max(*first_too_many, kLeastPairs);
}

}  // namespace

std::set<SubmapPair> spare_pairs(const VerdictSet& verdicts, const SubmapSet& submaps, const PairLimits& limits) {
  std::vector<Placed> left = closed_pairs(verdicts, submaps);
  std::set<SubmapPair> spare;
  const auto leave_out = [&](const std::vector<std::size_t>& earlier, std::size_t most) {
    std::vector<Placed> others;
    for (std::size_t k = 0; k < left.size(); ++k)
      if (earlier[k] < most)
        others.push_back(left[k]);
      else
        spare.insert(left[k].second);
    left = std::move(others);
  };
  leave_out(earlier_with_chain(left), limits.with_one_chain);
  if (left.size() <= limits.in_all) return spare;
  const auto earlier = earlier_with_all(left);
  leave_out(earlier, pairs_per_submap(earlier, limits.in_all));
  return spare;
}

}  // namespace tutti::server
