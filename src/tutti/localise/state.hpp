// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::localise {

/// How well a robot knows where it is in a map that does not move.
enum class State : std::uint8_t {
  searching,  ///< It has not found its place yet.
  ambiguous,  ///< Several places fit what it sees.
  localised,  ///< One place explains what it sees.
  off_map,    ///< It has left what the map shows; odometry goes on from its last place.
  lost,       ///< Its sensors contradict where it was; it searches again.
  stale,      ///< Its sensors have shown nothing for some time.
  between,    ///< It is shut in, in a map with several floors: it may be in a lift.
};
[[nodiscard]] constexpr std::string_view to_string(State state) {
  constexpr std::string_view kWords[] = {"searching", "ambiguous", "localised",     "off the map",
                                         "lost",      "stale",     "between floors"};
  return kWords[static_cast<std::size_t>(state)];
}

/// A place of the map, by the submap that shows it.
struct PlaceFound {
  SubmapId submap;
  std::uint32_t floor = 1;
  Pose3 T_world_body;
};

/// Where a robot is in a map.
struct Located {
  Timestamp stamp;  ///< The pose's, by the robot's clock.
  State state = State::searching;
  std::string why;          ///< Why it is in the state, as a sentence's end.
  std::uint32_t floor = 1;  ///< KnownMap::Entry::floor of where T_world_body is.
  /// In the map's frame; nothing unless the state is localised, off_map or stale. Only when it is localised does the
  /// map show that the robot is there.
  std::optional<RelativePose> T_world_body;
  double age_s = 0.0;              ///< Since the map last showed it.
  std::optional<double> overlap;   ///< Share of the scan that showed it last which lay on the map; of scans alone.
  std::vector<PlaceFound> places;  ///< Where it may be, when it is ambiguous.
};

}  // namespace tutti::localise
