// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/server/map_refiner.hpp"

namespace tutti::verifiers {

/// Refines a map by bundle adjustment over everything that cameras saw of a job's submaps. Landmarks are merged where
/// neighbouring submaps share a keyframe, and where an accepted visual closure found them to be the same point.
class BundleRefiner final : public server::MapRefiner {
 public:
  static constexpr const char* kName = "bundle";
  static constexpr std::uint32_t kVersion = 4;  ///< A commit that changes the result of refine() raises it by hand.
  explicit BundleRefiner(const bundle::RefinementConfig& config);
  [[nodiscard]] MethodId id() const override { return {kName, kVersion, settings_hash(settings_)}; }
  [[nodiscard]] std::string settings() const override { return settings_; }
  [[nodiscard]] bool can_refine(const PayloadSize& size) const override { return size.observations > 0; }
  [[nodiscard]] Result<Refinement> refine(const RefinementJob& job, const server::SubmapSet& submaps,
                                          const server::PayloadStore& payloads) const override;

 private:
  bundle::RefinementConfig config_;
  std::string settings_;
};

}  // namespace tutti::verifiers
