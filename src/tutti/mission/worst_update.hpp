// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>

#include "tutti/mission/record.hpp"

namespace tutti::mission {

/// The update of a mission after which an estimate was worst in comparison with raw odometry.
struct WorstUpdate {
  double time_s = 0.0;          ///< Mission time of the update.
  double rmse_m = 0.0;          ///< Error of the estimate then,
  double onboard_rmse_m = 0.0;  ///< and of raw odometry.
};

/// Among the updates with a reference, the one with the largest rmse_m - onboard_rmse_m, the first of equals: for the
/// server's broadcast, and for the robot corrected by a policy. Nothing when no update has a reference.
std::optional<WorstUpdate> worst_of_server(std::span<const UpdateRecord> updates);
std::optional<WorstUpdate> worst_of_policy(std::span<const UpdateRecord> updates, const std::string& policy);

}  // namespace tutti::mission
