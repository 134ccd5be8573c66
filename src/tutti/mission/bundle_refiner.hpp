// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/perception/visual/verify.hpp"
#include "tutti/server/map_refiner.hpp"

namespace tutti::mission {

/// Bundle adjustment over all that cameras saw of a map: the landmarks of its submaps, joined where neighbours share a
/// keyframe and where an accepted visual closure found them to be the same.
class BundleRefiner final : public server::MapRefiner {
 public:
  BundleRefiner(const bundle::RefinementConfig& config, const visual::VisualClosureConfig& closures)
      : config_(config), closures_(closures) {}
  [[nodiscard]] Result<std::vector<server::RefinedStep>> refine(const server::MapToRefine& map) const override;
  /// Of the last map that had something to refine; nothing before.
  [[nodiscard]] std::optional<bundle::Refinement> last() const;

 private:
  using Matches = std::vector<visual::LandmarkPair>;
  [[nodiscard]] Result<std::vector<bundle::PosedSubmap>> posed(const server::MapToRefine& map) const;
  [[nodiscard]] const Matches& matches(const SubmapPair& pair, const Submap& first, const Submap& second) const;

  bundle::RefinementConfig config_;
  visual::VisualClosureConfig closures_;
  mutable std::mutex mutex_;  // guards what follows
  mutable std::map<SubmapPair, Matches> matches_;
  mutable std::optional<bundle::Refinement> last_;
};

/// Null for a mission whose closures do not come from cameras.
std::shared_ptr<const BundleRefiner> make_refiner(const MissionConfig& config);

}  // namespace tutti::mission
