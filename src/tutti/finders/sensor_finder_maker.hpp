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

/// The configured finder. Its id covers everything that its answers depend on: settings(), from which any worker can
/// make it.
std::shared_ptr<const server::ClosureFinder> make_finder(const FinderConfig& config);
/// The configured refiner; null when the finder does not use cameras.
std::shared_ptr<const server::MapRefiner> make_refiner(const FinderConfig& finder,
                                                       const bundle::RefinementConfig& config);

/// All settings that the configured finder's (refiner's) answers depend on, and no others, as YAML. Members of the
/// structs that are no settings are missing in it and get their defaults in a finder made from the text; code that
/// changes these members must give the finder a name of its own (NamedFinder).
std::string settings_of(const FinderConfig& config);
std::string settings_of(const bundle::RefinementConfig& config);

/// Makes finders and refiners of sensor data from such texts. Other finders need a reference or a mission, which no
/// text holds.
class SensorFinderMaker final : public server::FinderMaker {
 public:
  /// `feature_cache_mb` is for each finder made (FinderConfig).
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
