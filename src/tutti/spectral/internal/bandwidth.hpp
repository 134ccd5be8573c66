// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/spectral/graph.hpp"

namespace tutti::spectral::internal {

/// Node at each place, so that neighbours sit close together. Reverse Cuthill-McKee: breadth first, nodes of small
/// degree first. Components follow one another.
std::vector<int> bandwidth_reducing_order(const SparseMatrix& matrix);

}  // namespace tutti::spectral::internal
