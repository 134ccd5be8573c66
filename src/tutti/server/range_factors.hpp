// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/estimation/gnc.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// Moves the map to where odometry, closures and the ranges between robots that agree with these have it (docs/math.md,
/// "Ranges"). A range joins the places of two robots at one time, interpolated between their keyframes, so their stamps
/// must be of one clock. Ranges count between robots that are in one component already: alone they join none. Which of
/// them agree is decided by truncated least squares (GNC), as for fixes; where most of those from one session to one
/// robot do not, none of them counts, and none at all where the map with them contradicts its measurements. The map
/// stays as it is without usable ranges, except for MapEstimate::ranges.
MapEstimate with_ranges(MapEstimate map, const SubmapSet& submaps, const estimation::GncConfig& gnc);

}  // namespace tutti::server
