// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>

#include "tutti/base/ids.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti::server {

/// By how much each robot's odometry overstates its variances, as a factor on them in (0, 1]: the median over loops of
/// z^2 over the median of chi-square (6 degrees of freedom), where z is how far odometry misses to close the loop, in
/// all covariances on the way. Loops are the robot's accepted closures with itself, and pairs of closures with another
/// robot together with both odometries between them; loops that odometry leaves surer than the closure say nothing.
/// Front ends inflate their covariance to be on the safe side (and missions on recordings have to guess one); a map
/// that believes them says it knows less than it does. Never above 1: odometry that misses its closures is the business
/// of those who judge them (estimation/odometry_trial). Never below 1/25; 1 with fewer than 8 loops.
std::map<ChainId, double> odometry_variance_factors(const MapEstimate& map);

}  // namespace tutti::server
