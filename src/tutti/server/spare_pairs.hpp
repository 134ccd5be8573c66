// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <set>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Pairs of submaps whose closures need not be judged. Robots that stay in one room close nearly every pair of submaps;
/// beyond some number the map gains nothing from another one, and judging costs more than the square of their number.
///
/// The pairs between two chains are put in an order that is drawn from their names, so that it is a function of the
/// set, independent of which closures are right, and spread over the mission. A pair is spare when each of its two
/// submaps has `most` earlier pairs with the other's chain. Chains are counted by themselves, so that one robot's
/// closures, however many, never crowd out another's.
std::set<SubmapPair> spare_pairs(const VerdictSet& verdicts, const SubmapSet& submaps, std::size_t most);

}  // namespace tutti::server
