// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include "tutti/model/trajectory.hpp"
#include "tutti/perception/fit/misfit.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::fit {

/// The segments over which odometry stood still while the scans moved by more than kLeastDistance_m or kLeastTurn_deg:
/// visual odometry that repeats its last pose, wheels in the air. The scans must surely move (six sigma); the steps in
/// which the standstill begins and ends belong to it. All other steps are added to `moving`.
std::vector<Misfit> find_standstills(std::span<const ScanStep> steps, const Trajectory& odometry,
                                     std::vector<ScanStep>& moving);

}  // namespace tutti::fit
