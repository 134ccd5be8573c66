// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/known_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "tutti/base/content_hash.hpp"

namespace tutti::localise {

std::string map_id_of(std::string_view first_submap) { return fmt::format("{:016x}", content_hash(first_submap)); }

RobotId KnownMap::free_robot() const { return {submaps.empty() ? 0 : submaps.rbegin()->first.chain.robot.value + 1}; }

std::vector<SubmapId> KnownMap::near(const OnFloor& p_world, double radius_m, std::size_t most) const {
  std::vector<std::pair<double, SubmapId>> within;
  for (const auto& [submap, entry] : submaps) {
    const double distance_m = (entry.middle - p_world.p).norm();
    if (entry.floor == p_world.floor && distance_m <= radius_m) within.emplace_back(distance_m, submap);
  }
  std::ranges::sort(within);
  std::vector<SubmapId> out;
  for (std::size_t k = 0; k < std::min(most, within.size()); ++k) out.push_back(within[k].second);
  return out;
}

}  // namespace tutti::localise
