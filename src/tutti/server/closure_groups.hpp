// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Closures (positions in `edges`, between `nodes`) that tell about one pair of places: each is within 10 s of another
/// one of its group at both ends, on the same two chains. What made one of them wrong, two places that look alike, made
/// the others wrong, too, so however many they are, they are one witness. Left out are groups that are longer than 30 s
/// on either chain (no two places look alike for so long) or of more than 24 closures. By their first closures.
std::vector<std::vector<std::size_t>> closure_groups(const std::vector<MapNode>& nodes,
                                                     std::span<const PoseGraphEdge> edges,
                                                     std::span<const std::size_t> closures);

}  // namespace tutti::server
