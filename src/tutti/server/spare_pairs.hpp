// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <set>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// The pairs of submaps whose closures need not be judged. Robots that stay in one room close nearly every pair of
/// submaps; beyond some number the map gains nothing from another pair, while the cost of judging grows faster than the
/// square of the pairs' number.
///
/// The pairs between two chains are put in an order that is a hash of their ids. The order is thus a function of the
/// set, independent of which closures are right, and spread over the mission. A pair is spare when each of its two
/// submaps has `most` earlier pairs with the other's chain. Every chain is counted separately, so that the closures of
/// one robot never crowd out those of another.
std::set<SubmapPair> spare_pairs(const VerdictSet& verdicts, const SubmapSet& submaps, std::size_t most);

}  // namespace tutti::server
