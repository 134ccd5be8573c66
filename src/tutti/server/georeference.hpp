// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/estimation/gnc.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Lays the map on the earth by the fixes of its submaps (docs/math.md, "Position fixes"). Parts of the map whose place
/// is certain enough become one part, in the world of the first, although no closure joins them. Depending on
/// `config.mode` the map stays rigid or follows the fixes. Without usable fixes the map stays as it is, except that
/// MapEstimate::fixes reports what became of them.
MapEstimate georeferenced(MapEstimate map, const SubmapSet& submaps, const GeoreferenceConfig& config,
                          const estimation::GncConfig& gnc);

/// The map's pose graph, with the frame enu as one more node at the end if fixes tie the map to the earth.
PoseGraph graph_on_earth(const MapEstimate& map);

}  // namespace tutti::server
