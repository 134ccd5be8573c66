// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/spare_pairs.hpp"

#include <algorithm>
#include <cstdint>
#include <map>
#include <vector>

namespace tutti::server {
namespace {

/// The finaliser of splitmix64 (Steele, Lea, Flood 2014).
std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30U)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27U)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31U);
}

std::uint64_t place_in_line(const SubmapPair& pair) {
  std::uint64_t place = 0x9e3779b97f4a7c15ULL;
  for (const SubmapId& id : {pair.first, pair.second})
    place = mixed(place + ((std::uint64_t{id.robot.value} << 32U) | id.index));
  return place;
}

}  // namespace

std::set<SubmapPair> spare_pairs(const VerdictSet& verdicts, const SubmapSet& submaps, std::size_t most) {
  const auto counts = [&](const auto& entry) {
    return !entry.second.closures.empty() && submaps.contains(entry.first.first) &&
           submaps.contains(entry.first.second);
  };
  std::map<SubmapId, std::vector<std::uint64_t>> lines;
  for (const auto& entry : verdicts) {
    if (!counts(entry)) continue;
    lines[entry.first.first].push_back(place_in_line(entry.first));
    lines[entry.first.second].push_back(place_in_line(entry.first));
  }
  std::map<SubmapId, std::uint64_t> last;  // that is judged, of submaps with too many
  for (auto& [submap, line] : lines) {
    if (line.size() <= most) continue;
    const auto nth = line.begin() + static_cast<std::ptrdiff_t>(most - 1);
    std::ranges::nth_element(line, nth);
    last[submap] = *nth;
  }
  std::set<SubmapPair> spare;
  if (last.empty()) return spare;
  const auto is_behind = [&](SubmapId submap, std::uint64_t place) {
    const auto end = last.find(submap);
    return end != last.end() && place > end->second;
  };
  for (const auto& entry : verdicts) {
    const std::uint64_t place = place_in_line(entry.first);
    if (counts(entry) && is_behind(entry.first.first, place) && is_behind(entry.first.second, place))
      spare.insert(entry.first);
  }
  return spare;
}

}  // namespace tutti::server
