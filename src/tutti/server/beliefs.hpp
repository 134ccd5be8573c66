// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Which closures and odometry a map believes, without its poses: enough to explain why the next map differs.
struct Beliefs {
  using Ends = std::pair<KeyframeId, KeyframeId>;
  std::set<Ends> accepted, refused;  ///< Closures by their ends.
  std::vector<FailedOdometry> failed_odometry;
};
/// The beliefs of this map.
Beliefs beliefs_of(const MapEstimate& map);

/// Why a newer map differs from an older one in one chain.
struct ChangeReason {
  std::size_t found = 0;      ///< Closures of the chain that are accepted now and were unknown.
  std::size_t taken_up = 0;   ///< Closures that are accepted now and were refused.
  std::size_t dropped = 0;    ///< Closures that were accepted and are refused now, or gone.
  std::size_t failed = 0;     ///< Segments of the chain's odometry that count as failed now and did not before,
  std::size_t recovered = 0;  ///< and the reverse. A segment that only changes its ends counts as neither.
  std::size_t elsewhere = 0;  ///< Closures of other chains that were found, taken up or dropped.
  friend bool operator==(const ChangeReason&, const ChangeReason&) = default;
};
/// Compares what two maps take for true, as it concerns one chain.
ChangeReason reason_of_change(const Beliefs& older, const Beliefs& newer, const ChainId& chain);
/// Text such as "12 of its closures are new, 5 that were accepted are refused": a clause, not capitalised, without full
/// stop.
std::string to_string(const ChangeReason& reason);

}  // namespace tutti::server
