// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tutti/finders/feature_cache.hpp"
#include "tutti/finders/finder_config.hpp"
#include "tutti/perception/lidar/submap_features.hpp"
#include "tutti/perception/lidar/verify.hpp"
#include "tutti/perception/visual/submap_features.hpp"
#include "tutti/perception/visual/verify.hpp"
#include "tutti/server/closure_finder.hpp"

namespace tutti::finders {

/// From the submap clouds alone. Features stay in memory of the newest submaps that fit into `cache_bytes`; those of
/// others are computed again for every pair, with the same result.
class LidarClosureFinder final : public server::ClosureFinder {
 public:
  LidarClosureFinder(const lidar::LidarClosureConfig& config, int min_submap_gap, std::size_t cache_bytes);
  [[nodiscard]] MethodId id() const override { return {"lidar", lidar::kFinderVersion, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return first.points > 0 && second.points > 0;
  }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override;
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override;
  [[nodiscard]] const FeatureCache<lidar::SubmapFeatures>& cache() const { return cache_; }

 private:
  [[nodiscard]] Result<std::shared_ptr<const lidar::SubmapFeatures>> features_of(
      const Submap& submap, const server::PayloadStore& payloads) const;

  lidar::LidarClosureConfig config_;
  std::uint32_t min_submap_gap_;
  mutable FeatureCache<lidar::SubmapFeatures> cache_;
};

/// From what cameras saw alone. Features are kept as the LiDAR's are.
class VisualClosureFinder final : public server::ClosureFinder {
 public:
  VisualClosureFinder(const visual::VisualClosureConfig& config, int min_submap_gap, std::size_t cache_bytes);
  [[nodiscard]] MethodId id() const override { return {"visual", visual::kFinderVersion, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return first.observations > 0 && second.observations > 0;
  }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override;
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override;

 private:
  using Features = FeatureCache<visual::SubmapFeatures>::Features;
  [[nodiscard]] Result<Features> features_of(const Submap& submap, const server::PayloadStore& payloads) const;

  visual::VisualClosureConfig config_;
  std::uint32_t min_submap_gap_;
  mutable FeatureCache<visual::SubmapFeatures> cache_;
};

/// Several finders, one per kind of payload: a pair is compared by each that can. Mixed fleets meet through the robots
/// that carry both kinds.
class JointClosureFinder final : public server::ClosureFinder {
 public:
  explicit JointClosureFinder(std::vector<std::shared_ptr<const server::ClosureFinder>> finders);
  static constexpr std::uint32_t kVersion = 1000 * lidar::kFinderVersion + visual::kFinderVersion;
  [[nodiscard]] MethodId id() const override { return {"sensors", kVersion, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override;
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override;
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override;

 private:
  std::vector<std::shared_ptr<const server::ClosureFinder>> finders_;
};

/// Another finder, under a name that says what its settings are; so do its verdicts.
class NamedFinder final : public server::ClosureFinder {
 public:
  /// `settings`: ClosureFinder::settings().
  NamedFinder(std::shared_ptr<const server::ClosureFinder> finder, MethodId id, std::string settings)
      : finder_(std::move(finder)), id_(std::move(id)), settings_(std::move(settings)) {}
  [[nodiscard]] MethodId id() const override { return id_; }
  [[nodiscard]] std::string settings() const override { return settings_; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return finder_->can_compare(first, second);
  }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    return finder_->is_candidate(first, second);
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override {
    auto verdict = finder_->verify(first, second, payloads);
    if (verdict) verdict->finder = id_;
    return verdict;
  }

 private:
  std::shared_ptr<const server::ClosureFinder> finder_;
  MethodId id_;
  std::string settings_;
};

/// The configured finder, without a name.
std::shared_ptr<const server::ClosureFinder> make_unnamed_finder(const FinderConfig& config);

}  // namespace tutti::finders
