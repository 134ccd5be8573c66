// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"

namespace tutti::server {

/// Why none of the ranges that one session of a robot measured to one other robot counts.
enum class RangeObjection {
  none,
  clock,  ///< They fit at another time than their stamps.
  map,    ///< Too many contradict the map, or all are too long.
  robot,  ///< Most of the robot's others are refused, or most of all.
};

/// How the ranges that one session of a robot measured to one other robot were judged.
struct JudgedRanges {
  ChainId from;
  RobotId to;
  std::size_t ranges = 0;
  std::size_t unplaced = 0;  ///< Not both robots are in the map then, in one component; or half a second after another.
  std::size_t used = 0;      ///< The others contradict the map that odometry, closures and these ranges make.
  RangeObjection objection = RangeObjection::none;
  double clock_off_s = 0.0;  ///< With RangeObjection::clock: so much later than stamped they fit.
};

/// RangeObjection for people; empty for none.
std::string why_none(const JudgedRanges& judged);

/// All that ranges between robots do to a map.
struct Ranges {
  std::vector<JudgedRanges> judged;  ///< Sorted by (from, to).
  std::size_t edges = 0;             ///< So many edges at the end of MapEstimate::graph are ranges.
};

}  // namespace tutti::server
