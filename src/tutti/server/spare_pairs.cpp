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

}  // namespace

std::set<SubmapPair> spare_pairs(const VerdictSet& verdicts, const SubmapSet& submaps, std::size_t most) {
  std::vector<std::pair<SubmapPair, std::uint64_t>> closed;
  std::map<Line, std::vector<std::uint64_t>> lines;
  for (const auto& [pair, verdict] : verdicts) {
    if (verdict.closures.empty() || !has_both(submaps, pair)) continue;
    closed.emplace_back(pair, place_in_line(pair));
    for (const Line& line : lines_of(pair)) lines[line].push_back(closed.back().second);
  }
  std::map<Line, std::uint64_t> last;  // that is judged, where there are too many
  for (auto& [line, places] : lines) {
    if (places.size() <= most) continue;
    const auto nth = places.begin() + static_cast<std::ptrdiff_t>(most - 1);
    std::ranges::nth_element(places, nth);
    last[line] = *nth;
  }
  const auto is_behind = [&](const Line& line, std::uint64_t place) {
    const auto end = last.find(line);
    return end != last.end() && place > end->second;
  };
  std::set<SubmapPair> spare;
  for (const auto& [pair, place] : closed) {
    const auto lines_of_pair = lines_of(pair);
    if (std::ranges::all_of(lines_of_pair, [&](const Line& line) { return is_behind(line, place); }))
      spare.insert(pair);
  }
  return spare;
}

}  // namespace tutti::server
