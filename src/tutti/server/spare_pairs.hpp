// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <set>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// How many pairs of submaps are judged.
struct PairLimits {
  std::size_t with_one_chain = 0;  ///< Per submap and chain.
  std::size_t in_all = 0;          ///< In the whole map, unless that leaves a submap fewer than kLeastPairs.
};
inline constexpr std::size_t kLeastPairs = 5;

/// The pairs of submaps whose closures need not be judged. Robots that stay in one room close nearly every pair of
/// submaps, and with every robot that comes to a place closures there grow by the square; beyond some number the map
/// gains nothing from another pair, while the cost of judging grows faster than the square of the pairs' number.
///
/// The pairs between two chains are put in an order that is a hash of their ids. The order is thus a function of the
/// set, independent of which closures are right, and spread over the mission. A pair is spare when each of its two
/// submaps has `with_one_chain` earlier pairs with the other's chain. Every chain is counted separately, so that the
/// closures of one robot never crowd out those of another.
///
/// Where more than `in_all` are left, so are those spare of which each submap has enough earlier pairs: as many for
/// every submap as the limit allows, the chains that it closes with taking turns.
std::set<SubmapPair> spare_pairs(const VerdictSet& verdicts, const SubmapSet& submaps, const PairLimits& limits);

}  // namespace tutti::server
