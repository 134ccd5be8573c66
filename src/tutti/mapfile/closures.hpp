// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tutti/mapfile/content.hpp"

namespace tutti::mapfile {

/// The map's judgement of a closure.
enum class ClosureState {
  candidate,  ///< Found, but not judged: enough other closures tie these submaps, or the map leaves out one of them.
  accepted,
  rejected
};
/// "candidate", "accepted", "rejected".
const char* to_string(ClosureState state);

/// A closure, and how well it fits the joint map.
struct ClosureFit {
  LoopClosure closure;
  ClosureState state = ClosureState::candidate;
  std::string reason;  ///< Why it is not in the map, with the rule's number (judge::reason_of); empty if it is.
  /// Difference between the closure and the map, and its squared Mahalanobis distance in the closure's covariance (6
  /// degrees of freedom). No value when the map does not join the closure's two ends.
  struct Misfit {
    double position_m = 0.0;
    double rotation_rad = 0.0;
    double chi2 = 0.0;
  };
  std::optional<Misfit> misfit;
};

/// The closures between two submaps, and why they are in the map or not.
struct ClosureInfo {
  SubmapPair pair;
  std::string name;
  ClosureState state = ClosureState::candidate;  ///< Accepted when any of the closures is.
  std::string reason;                       ///< For people: why the state is not accepted, or which operator decided.
  std::vector<ClosureFit> closures;         ///< Empty when an operator has rejected in advance what may be found.
  std::optional<ClosureVerdict> verdict;    ///< With the evidence, the verifier's version, the worker and the time.
  std::optional<ClosureDecision> decision;  ///< The operator's decision, also one that was withdrawn.
};

/// All pairs with closures or with a decision that was not withdrawn, by their submaps.
std::vector<ClosureInfo> closures(const Content& content, const server::MapEstimate& map);

}  // namespace tutti::mapfile
