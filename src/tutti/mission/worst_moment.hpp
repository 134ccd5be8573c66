// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>

#include "tutti/mission/record.hpp"

namespace tutti::mission {

/// When an estimate was worst beside raw odometry while the mission ran.
struct WorstMoment {
  double time_s = 0.0;          ///< Mission time of the update.
  double rmse_m = 0.0;          ///< Of the estimate then,
  double onboard_rmse_m = 0.0;  ///< ... and of raw odometry.
};

/// Of the updates with a reference the one with the largest rmse_m - onboard_rmse_m, the first of equals: of the
/// server's broadcast, and of the robot corrected by a policy. Nothing where none has a reference.
std::optional<WorstMoment> worst_of_server(std::span<const UpdateRecord> updates);
std::optional<WorstMoment> worst_of_policy(std::span<const UpdateRecord> updates, const std::string& policy);

}  // namespace tutti::mission
