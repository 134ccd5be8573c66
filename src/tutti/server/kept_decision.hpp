// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/base/result.hpp"
#include "tutti/model/closure_decision.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Closures were found between these submaps.
bool has_closures(const VerdictSet& verdicts, const SubmapPair& pair);

/// The decision as a map with these submaps, verdicts and decisions keeps it, whether a server takes it or it is
/// written into the map's file; nothing when a later one on the pair holds. Fails when the pair is not in order, the
/// map lacks one of the submaps, there is no closure to accept, or one by hand is between keyframes that these do not
/// have.
Result<std::optional<ClosureDecision>> kept_decision(const SubmapPair& pair, const ClosureDecision& given,
                                                     const SubmapSet& submaps, const VerdictSet& verdicts,
                                                     const DecisionSet& decisions);

}  // namespace tutti::server
