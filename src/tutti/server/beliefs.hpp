// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// What a map holds for true, without its poses: enough to say why the next map differs from it.
struct Beliefs {
  using Ends = std::pair<KeyframeId, KeyframeId>;
  std::set<Ends> accepted, refused;  ///< Closures.
  std::vector<FailedOdometry> failed_odometry;
};
Beliefs beliefs_of(const MapEstimate& map);

/// Why a newer map differs from an older one in one chain.
struct ChangeReason {
  std::size_t found = 0;      ///< Closures of the chain that are accepted and were not known.
  std::size_t taken_up = 0;   ///< That are accepted and were refused.
  std::size_t dropped = 0;    ///< That were accepted and are refused, or gone.
  std::size_t failed = 0;     ///< Stretches of the chain's odometry that are taken to have failed and were not,
  std::size_t recovered = 0;  ///< and the reverse. A stretch that only changes its ends is neither.
  std::size_t elsewhere = 0;  ///< Closures of other chains that were found, taken up or dropped.
  friend bool operator==(const ChangeReason&, const ChangeReason&) = default;
};
ChangeReason reason_of_change(const Beliefs& older, const Beliefs& newer, const ChainId& chain);
/// "12 of its closures are new, 5 that were accepted are refused": the first letter small, no full stop.
std::string to_string(const ChangeReason& reason);

}  // namespace tutti::server
