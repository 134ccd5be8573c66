// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/worst_update.hpp"

#include <algorithm>

namespace tutti::mission {
namespace {

template <class Rmse>
std::optional<WorstUpdate> worst_update(std::span<const UpdateRecord> updates, const Rmse& rmse_of) {
  std::optional<WorstUpdate> worst;
  for (const UpdateRecord& update : updates) {
    const std::optional<double> rmse_m = rmse_of(update);
    if (!rmse_m || !update.onboard_rmse_m) continue;
    const WorstUpdate candidate{update.time_s, *rmse_m, *update.onboard_rmse_m};
    if (!worst || candidate.rmse_m - candidate.onboard_rmse_m > worst->rmse_m - worst->onboard_rmse_m)
      worst = candidate;
  }
  return worst;
}

}  // namespace

std::optional<WorstUpdate> worst_of_server(std::span<const UpdateRecord> updates) {
  return worst_update(updates, [](const UpdateRecord& update) { return update.server_rmse_m; });
}

std::optional<WorstUpdate> worst_of_policy(std::span<const UpdateRecord> updates, const std::string& policy) {
  return worst_update(updates, [&](const UpdateRecord& update) -> std::optional<double> {
    const auto answer = std::ranges::find(update.answers, policy, &AnswerRecord::policy);
    return answer == update.answers.end() ? std::nullopt : answer->rmse_m;
  });
}

}  // namespace tutti::mission
