// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/verifiers/verifier_config.hpp"

namespace tutti::verifiers {

/// The configured verifier. Its id covers everything that its answers depend on: settings(), from which any worker can
/// make it.
std::shared_ptr<const server::ClosureVerifier> make_verifier(const VerifierConfig& config);
/// The configured refiner; null when the verifier does not use cameras.
std::shared_ptr<const server::MapRefiner> make_refiner(const VerifierConfig& verifier,
                                                       const bundle::RefinementConfig& config);

/// All settings that the configured verifier's (refiner's) answers depend on, and no others, as YAML. Members of the
/// structs that are no settings are missing in it and get their defaults in a verifier made from the text; code that
/// changes these members must give the verifier a name of its own (NamedVerifier).
std::string settings_of(const VerifierConfig& config);
std::string settings_of(const bundle::RefinementConfig& config);

/// Makes verifiers and refiners of sensor data from such texts. Other verifiers need a reference or a mission, which no
/// text contains.
class SensorVerifierMaker final : public server::VerifierMaker {
 public:
  /// `feature_cache_mb` is for each verifier made (VerifierConfig).
  explicit SensorVerifierMaker(double feature_cache_mb) : feature_cache_mb_(feature_cache_mb) {}
  [[nodiscard]] std::vector<MethodId> can() const override;
  [[nodiscard]] Result<std::shared_ptr<const server::ClosureVerifier>> verifier(
      const MethodId& id, const std::string& settings) const override;
  [[nodiscard]] Result<std::shared_ptr<const server::MapRefiner>> refiner(const MethodId& id,
                                                                          const std::string& settings) const override;

 private:
  double feature_cache_mb_;
};

}  // namespace tutti::verifiers
