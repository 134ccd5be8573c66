// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/perception/lidar/submap_features.hpp"
#include "tutti/perception/lidar/verify.hpp"
#include "tutti/perception/visual/submap_features.hpp"
#include "tutti/perception/visual/verify.hpp"
#include "tutti/server/closure_verifier.hpp"
#include "tutti/verifiers/feature_cache.hpp"
#include "tutti/verifiers/verifier_config.hpp"

namespace tutti::verifiers {

/// Finds closures from submap clouds. Features of the newest submaps are kept in `cache_bytes` of memory; those of
/// others are computed again for each pair, with the same result.
class LidarClosureVerifier final : public server::ClosureVerifier {
 public:
  LidarClosureVerifier(const lidar::LidarClosureConfig& config, int min_submap_gap, std::size_t cache_bytes);
  static constexpr const char* kName = "lidar";
  [[nodiscard]] MethodId id() const override { return {kName, lidar::kVerifierVersion, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return first.points > 0 && second.points > 0;
  }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override;
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override;
  [[nodiscard]] Result<Inspection> inspect(const Submap& first, const Submap& second,
                                           const server::PayloadStore& payloads,
                                           const std::optional<Pose3>& T_first_second) const override;
  [[nodiscard]] std::string place_of(const Submap& submap) const override;
  [[nodiscard]] bool can_rank(std::string_view place) const override;
  [[nodiscard]] std::vector<Likeness> likeness(std::string_view place,
                                               std::span<const std::string_view> others) const override;
  [[nodiscard]] const FeatureCache<lidar::SubmapFeatures>& cache() const { return cache_; }

 private:
  [[nodiscard]] Result<std::shared_ptr<const lidar::SubmapFeatures>> features_of(
      const Submap& submap, const server::PayloadStore& payloads) const;

  lidar::LidarClosureConfig config_;
  std::uint32_t min_submap_gap_;
  mutable FeatureCache<lidar::SubmapFeatures> cache_;
};

/// Finds closures from what cameras saw. Features are kept as LidarClosureVerifier keeps them.
class VisualClosureVerifier final : public server::ClosureVerifier {
 public:
  VisualClosureVerifier(const visual::VisualClosureConfig& config, int min_submap_gap, std::size_t cache_bytes);
  static constexpr const char* kName = "visual";
  [[nodiscard]] MethodId id() const override { return {kName, visual::kVerifierVersion, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return first.observations > 0 && second.observations > 0;
  }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override;
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override;
  [[nodiscard]] std::string place_of(const Submap& submap) const override;
  [[nodiscard]] bool can_rank(std::string_view place) const override;
  [[nodiscard]] std::vector<Likeness> likeness(std::string_view place,
                                               std::span<const std::string_view> others) const override;

 private:
  using Features = FeatureCache<visual::SubmapFeatures>::Features;
  [[nodiscard]] Result<Features> features_of(const Submap& submap, const server::PayloadStore& payloads) const;

  visual::VisualClosureConfig config_;
  std::uint32_t min_submap_gap_;
  mutable FeatureCache<visual::SubmapFeatures> cache_;
};

/// Combines several verifiers, one per kind of payload: each pair is compared by every verifier that can, and where
/// several find closures, each counts for its share. Robots with
/// different sensors are joined through robots that carry both kinds. A place is what every verifier that can compare
/// its submap computes of it; each ranks by its own part, as the sensor of its number. A place that one of them cannot
/// describe is unknown.
class JointClosureVerifier final : public server::ClosureVerifier {
 public:
  explicit JointClosureVerifier(std::vector<std::shared_ptr<const server::ClosureVerifier>> verifiers);
  static constexpr const char* kName = "sensors";
  static constexpr std::uint32_t kVersion = 1000 * lidar::kVerifierVersion + visual::kVerifierVersion;
  [[nodiscard]] MethodId id() const override { return {kName, kVersion, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override;
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override;
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override;
  [[nodiscard]] Result<Inspection> inspect(const Submap& first, const Submap& second,
                                           const server::PayloadStore& payloads,
                                           const std::optional<Pose3>& T_first_second) const override;
  [[nodiscard]] std::string place_of(const Submap& submap) const override;
  [[nodiscard]] bool can_rank(std::string_view place) const override { return !parts_of(place).empty(); }
  [[nodiscard]] std::vector<Likeness> likeness(std::string_view place,
                                               std::span<const std::string_view> others) const override;

 private:
  /// Each verifier's part of a place, empty where it has none. Nothing when it is no such place.
  [[nodiscard]] std::vector<std::string_view> parts_of(std::string_view place) const;
  std::vector<std::shared_ptr<const server::ClosureVerifier>> verifiers_;
};

/// Another verifier under an id that covers its settings; its verdicts carry this id too.
class NamedVerifier final : public server::WrappedVerifier {
 public:
  /// `settings` is the text that ClosureVerifier::settings() returns.
  NamedVerifier(std::shared_ptr<const server::ClosureVerifier> verifier, MethodId id, std::string settings)
      : WrappedVerifier(std::move(verifier)), id_(std::move(id)), settings_(std::move(settings)) {}
  [[nodiscard]] MethodId id() const override { return id_; }
  [[nodiscard]] std::string settings() const override { return settings_; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override {
    auto verdict = wrapped().verify(first, second, payloads);
    if (verdict) verdict->verifier = id_;
    return verdict;
  }

 private:
  MethodId id_;
  std::string settings_;
};

}  // namespace tutti::verifiers
