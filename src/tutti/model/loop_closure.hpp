// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
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

/// Outcome of verifying one pair. A verdict depends on the two submaps alone, never on the map's state, so that the map
/// is a function of the set of submaps and verdicts.
struct ClosureVerdict {
  SubmapPair pair;
  std::vector<LoopClosure> closures;  ///< Empty = refused.
  std::string reason;                 ///< Why refused; empty when accepted.
  friend bool operator==(const ClosureVerdict&, const ClosureVerdict&) = default;
};

}  // namespace tutti
