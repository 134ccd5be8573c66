// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/spectral/graph.hpp"

namespace tutti::spectral::internal {

/// Node at each place, so that neighbours sit close together. Reverse Cuthill-McKee: breadth first, nodes of small
/// degree first. Components follow one another.
std::vector<int> bandwidth_reducing_order(const SparseMatrix& matrix);

/// The same nodes, in groups of `count` that have many neighbours in common: each begins with the first node of `order`
/// that is left, and takes, one after the other, the node that has the strongest edges into the group. Where
/// robots cross an area, eight rows in the first order share 37 % of their columns, in this one 68 %; in a tunnel both
/// are alike. `matrix` is a Laplacian.
std::vector<int> gather_neighbours(const SparseMatrix& matrix, const std::vector<int>& order, int count);

}  // namespace tutti::spectral::internal
