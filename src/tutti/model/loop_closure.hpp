// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/model/method_id.hpp"
#include "tutti/model/refusal.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti {

/// A loop closure: the relative pose T_from_to between two keyframes, found by the server from what sensors saw.
struct LoopClosure {
  KeyframeId from;
  KeyframeId to;
  RelativePose measurement;
  friend bool operator==(const LoopClosure&, const LoopClosure&) = default;
};

/// Two submaps that may show the same place; always first < second.
struct SubmapPair {
  SubmapId first;
  SubmapId second;
  friend auto operator<=>(const SubmapPair&, const SubmapPair&) = default;
};

/// Outcome of verifying one pair: either closures or a refusal. A verdict depends on the two submaps and the finder
/// only, never on the state of the map; therefore the map is a function of the set of submaps and verdicts.
struct ClosureVerdict {
  SubmapPair pair;
  std::vector<LoopClosure> closures;  ///< From keyframes of pair.first to keyframes of pair.second.
  std::optional<Refusal> refusal;     ///< Why there are no closures.
  MethodId finder;                    ///< server::ClosureFinder::id() of the finder that verified the pair.
  // What follows is for people, and only set with closures; the map does not depend on it.
  std::vector<Refusal> evidence;        ///< What the finder measured, with the limit that each value met.
  std::optional<std::uint32_t> worker;  ///< Which worker verified the pair; nothing when unknown.
  std::int64_t verified_ns = 0;         ///< When, by that worker's clock, since the Unix epoch; 0 when unknown.
  friend bool operator==(const ClosureVerdict&, const ClosureVerdict&) = default;
};

}  // namespace tutti
