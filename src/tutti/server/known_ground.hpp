// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <set>
#include <span>
#include <vector>

#include "tutti/server/map_estimate.hpp"

/// So that the cost of a map grows with its area, not with the hours that robots drive in it, a submap that shows
/// ground which others have shown often enough is *retired*. New submaps are not compared with it; a few of its
/// closures with the others locate its robot, and when the robot begins another session it leaves the map.
namespace tutti::server {

/// The submaps to be retired, in the order in which they ended: each whose keyframes all lie within
/// `config.reach_m` of the keyframes of `config.visits` earlier submaps of the map with which it has accepted closures,
/// and whose neighbours in its chain are so, too. So nothing hangs on a submap that is retired: what leads into new
/// ground, and what joins it to known ground, stays. `is_verified` says whether all pairs of a submap have their
/// verdicts. A function of its arguments; `retired` are those of before.
std::vector<SubmapId> known_submaps(const MapEstimate& map, const SubmapSet& submaps,
                                    const std::set<SubmapPair>& accepted, const std::set<SubmapId>& retired,
                                    const KnownGroundConfig& config, const std::function<bool(SubmapId)>& is_verified);

/// The pairs of which the map has accepted a closure.
std::set<SubmapPair> accepted_pairs(const MapEstimate& map, const VerdictSet& verdicts);

/// The retired submaps that the map does not show any more: those of earlier sessions than their robot's newest one.
/// The newest stays whole, as its robot withdraws constraints between keyframes that the map has no more. Where a
/// session begins with retired ones, the last kAnchors of these stay, so that what follows is not joined by its own
/// closures alone.
std::set<SubmapId> hidden_of(const SubmapSet& submaps, const std::set<SubmapId>& retired);
inline constexpr std::size_t kAnchors = 5;

/// The closures that a retired submap keeps, in pairs of submaps.
inline constexpr std::size_t kTies = 5;
/// The pairs of submaps whose verdicts are not needed any more: of those in `chosen`, which are retired just now, all
/// that are not accepted; of all that are retired, those with each other, of what is hidden, and all but kTies.
std::set<SubmapPair> superfluous(const VerdictSet& verdicts, const std::set<SubmapPair>& accepted,
                                 const SubmapSet& submaps, const std::set<SubmapId>& retired,
                                 std::span<const SubmapId> chosen);

/// The submaps without those that are hidden. Where these lie between others of their chain, one step of odometry leads
/// over them.
SubmapSet without_hidden(const SubmapSet& submaps, const std::set<SubmapId>& hidden);

/// As estimate_map_with_fixes(), at a cost that does not grow with the submaps that are retired: those that are
/// still shown have no closures with each other, and of the hidden ones (hidden_of()) nothing is left but a step of
/// odometry.
MapEstimate estimate_known_map(const SubmapSet& submaps, const std::set<SubmapId>& retired, const VerdictSet& verdicts,
                               const MapConfig& config, const DecisionSet& decisions);

}  // namespace tutti::server
