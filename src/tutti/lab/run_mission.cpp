// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/run_mission.hpp"

#include <utility>

#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/shadows.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"

namespace tutti::lab {

Result<mission::MissionRecord> run_mission(const MissionConfig& config, mission::RunOptions options) {
  auto input = load_input(config, options.data, options.seed);
  if (!input) return tl::unexpected(input.error());
  options.settings_yaml = to_yaml(config);
  mission::MissionParts parts{.input = std::move(*input),
                              .verifier = nullptr,
                              .refiner = verifiers::make_refiner(config.closures, config.refinement),
                              .companions = [&config, &options](const Recording& recording) {
                                return make_shadows(recording, config.agent, config.compare_policies, options.seed);
                              }};
  parts.verifier = make_closure_verifier(config, parts.input.robots, options.seed);
  return mission::run_mission(config, std::move(parts), options);
}

}  // namespace tutti::lab
