// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/judge/odometry_trajectories.hpp"
#include "tutti/judge/settings.hpp"

namespace tutti::judge {

/// Per closure, whether anything supports it, because random wrong closures, which hardly anything supports, would only
/// pull the first solution astray. A closure is supported by the odometry between its own ends, or by
/// config.least_support other closures that agree with it (by all others, where there are fewer). Two closures between
/// the same two segments of odometry agree when the cycle over both and the odometry between their ends closes within
/// the chi-square quantile config.confidence of its covariance (Mangelson, Dominic, Eustice, Vasudevan, ICRA 2018, eqs.
/// 7 to 9); nothing before or after them enters. Fewer than config.min_joining_closures between two segments are not
/// supported.
std::vector<bool> supported_closures(const OdometryTrajectories& odometry, std::span<const PoseGraphEdge> closures,
                                     const OutlierRejectionConfig& config);

}  // namespace tutti::judge
