// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/spare_pairs.hpp"

#include <algorithm>
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

}  // namespace

std::set<SubmapPair> spare_pairs(const VerdictSet& verdicts, const SubmapSet& submaps, std::size_t most) {
  std::vector<std::pair<SubmapPair, std::uint64_t>> closed;
  std::map<SubmapId, std::vector<std::uint64_t>> lines;
  for (const auto& [pair, verdict] : verdicts) {
    if (verdict.closures.empty() || !submaps.contains(pair.first) || !submaps.contains(pair.second)) continue;
    closed.emplace_back(pair, place_in_line(pair));
    for (const SubmapId& submap : {pair.first, pair.second}) lines[submap].push_back(closed.back().second);
  }
  std::map<SubmapId, std::uint64_t> last;  // that is judged, of submaps with too many
  for (auto& [submap, line] : lines) {
    if (line.size() <= most) continue;
    const auto nth = line.begin() + static_cast<std::ptrdiff_t>(most - 1);
    std::ranges::nth_element(line, nth);
    last[submap] = *nth;
  }
  const auto is_behind = [&](SubmapId submap, std::uint64_t place) {
    const auto end = last.find(submap);
    return end != last.end() && place > end->second;
  };
  std::set<SubmapPair> spare;
  for (const auto& [pair, place] : closed)
    if (is_behind(pair.first, place) && is_behind(pair.second, place)) spare.insert(pair);
  return spare;
}

}  // namespace tutti::server
