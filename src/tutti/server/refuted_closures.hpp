// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <set>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Pairs of submaps of two sessions whose accepted closures contradict position fixes: each session alone lies on the
/// earth for certain, and there the ends of a closure are farther apart than it measures by five times their
/// uncertainty. A few wrong closures that agree can join two robots anywhere, but the fixes of a whole run do not err
/// so. Closures that an operator has accepted are exempt.
std::set<SubmapPair> refuted_by_fixes(const MapEstimate& map, const SubmapSet& submaps, const VerdictSet& verdicts,
                                      const GeoreferenceConfig& config, const DecisionSet& decisions);

/// As estimate_map(), without the closures that fixes refute.
MapEstimate estimate_map_with_fixes(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config,
                                    const DecisionSet& decisions = {});

}  // namespace tutti::server
