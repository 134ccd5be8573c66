// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tutti/mission/mission_config.hpp"
#include "tutti/server/closure_finder.hpp"

namespace tutti::mission {

/// All of the settings that the configured finder's answers depend on, as YAML, and nothing else.
std::string settings_of(const ClosureConfig& config, std::uint64_t seed);
std::string settings_of(const bundle::RefinementConfig& config);

/// Makes every finder and refiner of sensor data of these texts. What a reference finder needs is in no text: only who
/// has the mission has it.
class SensorFinderMaker final : public server::FinderMaker {
 public:
  /// `feature_cache_mb`: of each finder (ClosureConfig).
  explicit SensorFinderMaker(double feature_cache_mb) : feature_cache_mb_(feature_cache_mb) {}
  [[nodiscard]] std::vector<MethodId> can() const override;
  [[nodiscard]] Result<std::shared_ptr<const server::ClosureFinder>> finder(const MethodId& id,
                                                                            const std::string& settings) const override;
  [[nodiscard]] Result<std::shared_ptr<const server::MapRefiner>> refiner(const MethodId& id,
                                                                          const std::string& settings) const override;

 private:
  double feature_cache_mb_;
};

}  // namespace tutti::mission
