// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tutti/mapfile/content.hpp"

namespace tutti::mapfile {

enum class ClosureState {
  candidate,  ///< Found, but not judged: enough others tie these submaps, or a submap is left out of the map.
  accepted,
  rejected
};
const char* to_string(ClosureState state);

/// How a closure stands to the joint map.
struct ClosureFit {
  LoopClosure closure;
  ClosureState state = ClosureState::candidate;
  judge::Objection objection = judge::Objection::none;
  /// By how much the map differs from it, and its squared error in units of its covariance (6 degrees of freedom);
  /// nothing when the map does not join its two ends.
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
  ClosureState state = ClosureState::candidate;  ///< Accepted when any of them is.
  std::string reason;                            ///< Why not accepted; who said so.
  std::vector<ClosureFit> closures;              ///< None: an operator has rejected in advance what may be found.
  std::optional<ClosureVerdict> verdict;         ///< Evidence, version of the finder, who verified it and when.
  std::optional<ClosureWord> word;               ///< The operator's, also when it is withdrawn.
};

/// All pairs with closures or words, by their submaps.
std::vector<ClosureInfo> closures(const Content& content, const server::MapEstimate& map);

}  // namespace tutti::mapfile
