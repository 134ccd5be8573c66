// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "tutti/estimation/range_parameters.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// A range between two nodes of the map.
struct PlacedRange : estimation::GraphRange {
  std::size_t judged = 0;        ///< Position in Ranges::judged.
  Eigen::Vector3d v_from, v_to;  ///< Velocities of the antennas, each in its node's body frame, m/s.
};

/// The ranges whose both ends the map has, at one time and in one component; all are counted in `counts`, in which none
/// is counted before. Where a robot was between two keyframes odometry says, where these are at most 5 s apart.
std::vector<PlacedRange> place_ranges(const MapEstimate& map, const SubmapSet& submaps, Ranges& counts);

}  // namespace tutti::server
