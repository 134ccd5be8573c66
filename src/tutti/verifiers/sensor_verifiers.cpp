// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/verifiers/sensor_verifiers.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <functional>
#include <iterator>
#include <system_error>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/place_descriptor.hpp"
#include "tutti/perception/lidar/verify.hpp"
#include "tutti/perception/visual/place_descriptor.hpp"
#include "tutti/perception/visual/verify.hpp"

namespace tutti::verifiers {
namespace {

template <class Matcher>
std::vector<server::ClosureVerifier::Likeness> likeness_by(const Matcher& matcher,
                                                           std::span<const std::string_view> others) {
  std::vector<server::ClosureVerifier::Likeness> out;
  for (std::size_t i = 0; i < others.size(); ++i) out.push_back({.other = i, .value = matcher.likeness(others[i])});
  return out;
}

constexpr std::string_view kJoined = "places ";  // no verifier's own begins so

}  // namespace

LidarClosureVerifier::LidarClosureVerifier(const lidar::LidarClosureConfig& config, int min_submap_gap,
                                           std::size_t cache_bytes)
    : config_(config), min_submap_gap_(static_cast<std::uint32_t>(min_submap_gap)), cache_(cache_bytes) {}

bool LidarClosureVerifier::is_candidate(const Submap& first, const Submap& second) const {
  return first.id.chain != second.id.chain || second.id.index - first.id.index >= min_submap_gap_;  // first < second
}

Result<ClosureVerdict> LidarClosureVerifier::verify(const Submap& first, const Submap& second,
                                                    const server::PayloadStore& payloads) const {
  const auto features_a = features_of(first, payloads);
  if (!features_a) return tl::unexpected(features_a.error());
  const auto features_b = features_of(second, payloads);
  if (!features_b) return tl::unexpected(features_b.error());
  const auto& a = *features_a;
  const auto& b = *features_b;
  const auto refuse = [&](const std::optional<Refusal>& refusal) {
    return ClosureVerdict{{first.id, second.id}, {}, refusal, id()};
  };
  if (!a->usable || !b->usable) return refuse(a->usable ? b->refusal : a->refusal);
  if (!lidar::plausible_pair(*a, *b)) return refuse(Refusal{RefusalReason::unlike_from_above});
  ClosureVerdict verdict = lidar::to_verdict(first, second, lidar::verify_pair(*a, *b, config_));
  verdict.verifier = id();
  return verdict;
}

Result<LidarClosureVerifier::Inspection> LidarClosureVerifier::inspect(
    const Submap& first, const Submap& second, const server::PayloadStore& payloads,
    const std::optional<Pose3>& T_first_second) const {
  const auto a = features_of(first, payloads);
  if (!a) return tl::unexpected(a.error());
  const auto b = features_of(second, payloads);
  if (!b) return tl::unexpected(b.error());
  lidar::PairVerification seen;
  if (!T_first_second) seen = lidar::verify_pair(**a, **b, config_);
  const bool is_aligned = T_first_second || seen.overlap > 0.0;
  if (is_aligned && !seen.accepted) {
    std::optional<Refusal> refusal = seen.refusal;  // also a rival, which the second comparison does not test for
    seen = lidar::verify_near(**a, **b, T_first_second.value_or(seen.T_a_b), config_);
    if (!T_first_second && refusal) seen.refusal = refusal;
  }
  Inspection out{.best = {}, .refusal = seen.refusal, .evidence = seen.evidence};
  if (seen.evidence.empty()) return out;
  seen.accepted = true;
  seen.refusal.reset();
  out.best = lidar::to_verdict(first, second, seen).closures.front();
  return out;
}

std::string LidarClosureVerifier::place_of(const Submap& submap) const {
  return lidar::describe_place(submap, config_);
}

bool LidarClosureVerifier::can_rank(std::string_view place) const { return lidar::is_descriptor(place, config_); }

std::vector<LidarClosureVerifier::Likeness> LidarClosureVerifier::likeness(
    std::string_view place, std::span<const std::string_view> others) const {
  return likeness_by(lidar::PlaceMatcher(place), others);
}

Result<std::shared_ptr<const lidar::SubmapFeatures>> LidarClosureVerifier::features_of(
    const Submap& submap, const server::PayloadStore& payloads) const {
  return cache_.get(submap.id, [&]() -> Result<FeatureCache<lidar::SubmapFeatures>::Features> {
    auto cloud = payloads.cloud(submap.id);
    if (!cloud) return tl::unexpected(cloud.error());
    Submap seen = submap;
    seen.cloud = std::move(*cloud);
    return std::make_shared<const lidar::SubmapFeatures>(lidar::extract_features(seen, config_));
  });
}

VisualClosureVerifier::VisualClosureVerifier(const visual::VisualClosureConfig& config, int min_submap_gap,
                                             std::size_t cache_bytes)
    : config_(config), min_submap_gap_(static_cast<std::uint32_t>(min_submap_gap)), cache_(cache_bytes) {}

bool VisualClosureVerifier::is_candidate(const Submap& first, const Submap& second) const {
  return visual::is_candidate(first, second, min_submap_gap_, config_);
}

Result<ClosureVerdict> VisualClosureVerifier::verify(const Submap& first, const Submap& second,
                                                     const server::PayloadStore& payloads) const {
  const auto a = features_of(first, payloads);
  if (!a) return tl::unexpected(a.error());
  const auto b = features_of(second, payloads);
  if (!b) return tl::unexpected(b.error());
  ClosureVerdict verdict = visual::verify_pair(**a, **b, config_);
  verdict.verifier = id();
  return verdict;
}

std::string VisualClosureVerifier::place_of(const Submap& submap) const {
  return visual::describe_place(submap, config_);
}

bool VisualClosureVerifier::can_rank(std::string_view place) const { return visual::is_descriptor(place); }

std::vector<VisualClosureVerifier::Likeness> VisualClosureVerifier::likeness(
    std::string_view place, std::span<const std::string_view> others) const {
  return likeness_by(visual::PlaceMatcher(place, config_), others);
}

Result<VisualClosureVerifier::Features> VisualClosureVerifier::features_of(const Submap& submap,
                                                                           const server::PayloadStore& payloads) const {
  return cache_.get(submap.id, [&]() -> Result<Features> {
    auto payload = payloads.visual(submap.id);
    if (!payload) return tl::unexpected(payload.error());
    Submap seen = submap;
    seen.visual = std::move(*payload);
    return std::make_shared<const visual::SubmapFeatures>(visual::extract_features(seen, config_));
  });
}

JointClosureVerifier::JointClosureVerifier(std::vector<std::shared_ptr<const server::ClosureVerifier>> verifiers)
    : verifiers_(std::move(verifiers)) {}

bool JointClosureVerifier::can_compare(const PayloadSize& first, const PayloadSize& second) const {
  return std::ranges::any_of(verifiers_, [&](const auto& verifier) { return verifier->can_compare(first, second); });
}

bool JointClosureVerifier::is_candidate(const Submap& first, const Submap& second) const {
  return std::ranges::any_of(verifiers_, [&](const auto& verifier) { return verifier->is_candidate(first, second); });
}

Result<ClosureVerdict> JointClosureVerifier::verify(const Submap& first, const Submap& second,
                                                    const server::PayloadStore& payloads) const {
  ClosureVerdict out{.pair = {first.id, second.id}, .verifier = id()};
  int sensors = 0;
  for (const auto& verifier : verifiers_) {
    if (!verifier->is_candidate(first, second)) continue;
    auto verdict = verifier->verify(first, second, payloads);
    if (!verdict) return verdict;
    sensors += verdict->closures.empty() ? 0 : 1;
    std::ranges::move(verdict->closures, std::back_inserter(out.closures));
    std::ranges::move(verdict->evidence, std::back_inserter(out.evidence));
    // "Too small" only means that a submap has no payload of this kind: any other reason takes its place.
    if (!out.refusal || out.refusal->reason == RefusalReason::too_small) out.refusal = verdict->refusal;
  }
  if (!out.closures.empty()) out.refusal.reset();
  // All sensors' closures of a pair have the errors of the same submaps' odometry, which laid out what each has seen.
  // How much of their errors that is, is not known: together they are no surer than their mean (covariance
  // intersection).
  for (LoopClosure& closure : out.closures) closure.measurement.covariance *= std::max(1, sensors);
  return out;
}

Result<JointClosureVerifier::Inspection> JointClosureVerifier::inspect(
    const Submap& first, const Submap& second, const server::PayloadStore& payloads,
    const std::optional<Pose3>& T_first_second) const {
  Inspection out{.best = {}, .refusal = Refusal{RefusalReason::other}, .evidence = {}};
  for (const auto& verifier : verifiers_) {
    auto inspection = verifier->inspect(first, second, payloads, T_first_second);
    if (!inspection || inspection->best) return inspection;
    if (inspection->refusal && inspection->refusal->reason != RefusalReason::too_small) out = std::move(*inspection);
  }
  return out;
}

/// The place of one verifier alone as that verifier words it; several parts after kJoined, and the length of each, as
/// text.
std::string JointClosureVerifier::place_of(const Submap& submap) const {
  const PayloadSize size = payload_size(submap);
  std::vector<std::string> parts;
  for (const auto& verifier : verifiers_) {
    const bool is_seen = verifier->can_compare(size, size);
    parts.push_back(is_seen ? verifier->place_of(submap) : std::string());
    if (is_seen && parts.back().empty()) return {};  // else another one's ranking would rule out what this one closes
  }
  const std::string all = fmt::format("{}", fmt::join(parts, ""));
  if (std::ranges::count_if(parts, std::not_fn(&std::string::empty)) <= 1) return all;
  std::string head(kJoined);
  for (const std::string& part : parts) head += fmt::format("{} ", part.size());
  return head + all;
}

std::vector<std::string_view> JointClosureVerifier::parts_of(std::string_view place) const {
  std::vector<std::string_view> parts(verifiers_.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!verifiers_[i]->can_rank(place)) continue;
    parts[i] = place;
    return parts;
  }
  if (!place.starts_with(kJoined)) return {};
  place.remove_prefix(kJoined.size());
  std::vector<std::size_t> sizes(parts.size());
  for (std::size_t& size : sizes) {
    const auto [end, error] = std::from_chars(place.data(), place.data() + place.size(), size);
    if (error != std::errc() || end == place.data() + place.size()) return {};
    place.remove_prefix(static_cast<std::size_t>(end - place.data()) + 1);
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (sizes[i] > place.size()) return {};
    parts[i] = place.substr(0, sizes[i]);
    if (!parts[i].empty() && !verifiers_[i]->can_rank(parts[i])) return {};
    place.remove_prefix(sizes[i]);
  }
  return place.empty() ? parts : std::vector<std::string_view>();
}

std::vector<JointClosureVerifier::Likeness> JointClosureVerifier::likeness(
    std::string_view place, std::span<const std::string_view> others) const {
  const std::vector<std::string_view> own = parts_of(place);
  std::vector<std::vector<std::string_view>> parts;
  for (const std::string_view other : others) parts.push_back(parts_of(other));
  std::vector<Likeness> out;
  for (std::size_t sensor = 0; sensor < own.size(); ++sensor) {
    if (own[sensor].empty()) continue;
    std::vector<std::size_t> which;
    std::vector<std::string_view> seen;
    for (std::size_t i = 0; i < others.size(); ++i) {
      if (parts[i].empty() || parts[i][sensor].empty()) continue;
      which.push_back(i);
      seen.push_back(parts[i][sensor]);
    }
    for (const auto& [other, value, _] : verifiers_[sensor]->likeness(own[sensor], seen))
      out.push_back({which[other], value, static_cast<std::uint32_t>(sensor)});
  }
  return out;
}

namespace {

using Made = std::shared_ptr<const server::ClosureVerifier>;

std::size_t cache_bytes(const VerifierConfig& config) {
  return static_cast<std::size_t>(config.feature_cache_mb * 1e6);
}

Made make_lidar(const VerifierConfig& config) {
  return std::make_shared<LidarClosureVerifier>(config.lidar, config.min_submap_gap, cache_bytes(config));
}

Made make_visual(const VerifierConfig& config) {
  return std::make_shared<VisualClosureVerifier>(config.visual, config.min_submap_gap, cache_bytes(config));
}

Made make_joint(const VerifierConfig& config) {
  return std::make_shared<JointClosureVerifier>(std::vector<Made>{make_lidar(config), make_visual(config)});
}

}  // namespace

const std::vector<VerifierKind>& verifier_kinds() {
  static const std::vector<VerifierKind> rows{
      {.name = LidarClosureVerifier::kName,
       .help = "from the submap clouds",
       .version = lidar::kVerifierVersion,
       .uses_scans = true,
       .settings = {"min_submap_gap", "lidar"},
       .make = &make_lidar},
      {.name = VisualClosureVerifier::kName,
       .help = "from images",
       .version = visual::kVerifierVersion,
       .uses_images = true,
       .settings = {"min_submap_gap", "visual"},
       .make = &make_visual},
      {.name = JointClosureVerifier::kName,
       .help = "from whatever two submaps both carry",
       .version = JointClosureVerifier::kVersion,
       .uses_scans = true,
       .uses_images = true,
       .settings = {"min_submap_gap", "lidar", "visual"},
       .make = &make_joint},
  };
  return rows;
}

const VerifierKind& VerifierConfig::kind() const {
  const VerifierKind* found = row_of(verifier_kinds(), verifier);
  TUTTI_CHECK(found != nullptr, "verifier '{}'", verifier);
  return *found;
}

}  // namespace tutti::verifiers
