// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/judge/odometry_ways.hpp"
#include "tutti/judge/settings.hpp"

namespace tutti::judge {

/// Per closure whether anything speaks for it: the odometry between its own ends, or `least_support` other closures
/// (where there are too few, those there are). Two closures between the same pieces of odometry agree when
/// the cycle over both and the odometry between their ends closes within the chi-square quantile of its covariance
/// (Mangelson, Dominic, Eustice, Vasudevan, ICRA 2018), so that nothing which happened before or after them counts.
/// Closures drawn at random agree with nearly none, and would only pull the first solution astray.
std::vector<bool> supported_closures(const OdometryWays& odometry, std::span<const PoseGraphEdge> closures,
                                     const WhoIsWrongConfig& config);

}  // namespace tutti::judge
