// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/finders/finder_config.hpp"
#include "tutti/server/closure_finder.hpp"

namespace tutti::finders {

/// The configured finder, under a name that says all that its answers depend on: `settings()`, of which any worker
/// makes it again.
std::shared_ptr<const server::ClosureFinder> make_finder(const FinderConfig& config);
/// Null where no cameras find closures.
std::shared_ptr<const server::MapRefiner> make_refiner(const FinderConfig& finder,
                                                       const bundle::RefinementConfig& config);

/// All of the settings that the configured finder's answers depend on, as YAML, and nothing else. Members of the
/// structs that are no settings are not in it: whoever makes the finder of the text has their defaults, so who changes
/// them in C++ gives the finder a name of its own (NamedFinder).
std::string settings_of(const FinderConfig& config);
std::string settings_of(const bundle::RefinementConfig& config);

/// Makes every finder and refiner of sensor data of these texts. What other finders need (a reference, a mission) is in
/// no text: only who has the mission has it.
class SensorFinderMaker final : public server::FinderMaker {
 public:
  /// `feature_cache_mb`: of each finder (FinderConfig).
  explicit SensorFinderMaker(double feature_cache_mb) : feature_cache_mb_(feature_cache_mb) {}
  [[nodiscard]] std::vector<MethodId> can() const override;
  [[nodiscard]] Result<std::shared_ptr<const server::ClosureFinder>> finder(const MethodId& id,
                                                                            const std::string& settings) const override;
  [[nodiscard]] Result<std::shared_ptr<const server::MapRefiner>> refiner(const MethodId& id,
                                                                          const std::string& settings) const override;

 private:
  double feature_cache_mb_;
};

}  // namespace tutti::finders
