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

/// A relative pose between two keyframes found by the server: T_a_b = T_from_to.
struct LoopClosure {
  KeyframeId from;
  KeyframeId to;
  RelativePose measurement;
  friend bool operator==(const LoopClosure&, const LoopClosure&) = default;
};

/// Two submaps that may show the same place. first < second, always.
struct SubmapPair {
  SubmapId first;
  SubmapId second;
  friend auto operator<=>(const SubmapPair&, const SubmapPair&) = default;
};

/// Outcome of verifying one pair: closures or a refusal, never both. A verdict depends on the two submaps and the
/// finder alone, never on the map's state, so that the map is a function of the set of submaps and verdicts.
struct ClosureVerdict {
  SubmapPair pair;
  std::vector<LoopClosure> closures;  ///< From keyframes of pair.first to keyframes of pair.second.
  std::optional<Refusal> refusal;     ///< When there are none.
  MethodId finder;                    ///< server::ClosureFinder::id(), of who says so.
  // For people, and of closures only; the map does not depend on these.
  std::vector<Refusal> evidence;        ///< What the finder measured, with the limit that each value kept.
  std::optional<std::uint32_t> worker;  ///< Who verified the pair; nothing: it was not said.
  std::int64_t verified_ns = 0;         ///< When, by that worker's clock, since the Unix epoch; 0: it was not said.
  friend bool operator==(const ClosureVerdict&, const ClosureVerdict&) = default;
};

}  // namespace tutti
