// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <set>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Pairs of submaps whose closures need not be judged, because both submaps have `most` others before this one with the
/// chain of the other. Robots that stay in one room close nearly every pair; the map gains nothing more from them, and
/// judging costs the square of their number and more. Which come first is drawn from their names: a function of the
/// set, whatever is right or wrong about them, and spread over the mission. Every chain is counted by itself, so that
/// no robot's closures, however many it makes, crowd out those of others.
std::set<SubmapPair> spare_pairs(const VerdictSet& verdicts, const SubmapSet& submaps, std::size_t most);

}  // namespace tutti::server
