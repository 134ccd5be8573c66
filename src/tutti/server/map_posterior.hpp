// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>

#include "tutti/estimation/marginals.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// How sure the map is of its poses: of `on_earth`, which is graph_on_earth(map), where odometry counts as much as its
/// closures show that it is worth. `pairs` as for JointPosterior.
std::unique_ptr<const estimation::JointPosterior> posterior_of(const MapEstimate& map, const PoseGraph& on_earth,
                                                               std::span<const estimation::JointPosterior::Pair> pairs);

}  // namespace tutti::server
