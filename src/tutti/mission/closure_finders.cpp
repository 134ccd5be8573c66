// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/closure_finders.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/finder_maker.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/verify.hpp"
#include "tutti/perception/visual/verify.hpp"

namespace tutti::mission {

LidarClosureFinder::LidarClosureFinder(const lidar::LidarClosureConfig& config, int min_submap_gap,
                                       std::size_t cache_bytes)
    : config_(config), min_submap_gap_(static_cast<std::uint32_t>(min_submap_gap)), cache_(cache_bytes) {}

bool LidarClosureFinder::is_candidate(const Submap& first, const Submap& second) const {
  return first.id.chain != second.id.chain || second.id.index - first.id.index >= min_submap_gap_;  // first < second
}

Result<ClosureVerdict> LidarClosureFinder::verify(const Submap& first, const Submap& second,
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
  verdict.finder = id();
  return verdict;
}

Result<std::shared_ptr<const lidar::SubmapFeatures>> LidarClosureFinder::features_of(
    const Submap& submap, const server::PayloadStore& payloads) const {
  return cache_.get(submap.id, [&]() -> Result<FeatureCache<lidar::SubmapFeatures>::Features> {
    auto cloud = payloads.cloud(submap.id);
    if (!cloud) return tl::unexpected(cloud.error());
    Submap seen = submap;
    seen.cloud = std::move(*cloud);
    return std::make_shared<const lidar::SubmapFeatures>(lidar::extract_features(seen, config_));
  });
}

namespace {

/// The keyframe next to a moment within this robot's submap; neighbouring submaps share no moment.
const Keyframe* keyframe_at(const Submap& submap, RobotId robot, Timestamp stamp) {
  const auto& keyframes = submap.keyframes;
  if (submap.id.chain.robot != robot || stamp < keyframes.front().stamp || keyframes.back().stamp <= stamp)
    return nullptr;
  return &*std::ranges::min_element(keyframes, {}, [&](const Keyframe& k) { return std::abs(k.stamp - stamp); });
}

}  // namespace

ReferenceClosureFinder::ReferenceClosureFinder(std::map<RobotId, Trajectory> reference,
                                               const simulation::ReferenceClosureConfig& config, std::uint64_t seed,
                                               std::vector<PlantedClosure> planted)
    : closures_(std::move(reference), config, seed), planted_(std::move(planted)) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(config.sigma_m), Eigen::Vector3d::Constant(config.sigma_deg * kRadPerDeg);
  covariance_ = sigma.cwiseAbs2().asDiagonal();
}

std::optional<LoopClosure> ReferenceClosureFinder::planted_in(const Submap& first, const Submap& second) const {
  const auto claim = [&](const PlantedClosure& planted, const Submap& from,
                         const Submap& to) -> std::optional<LoopClosure> {
    const Keyframe* a = keyframe_at(from, planted.other, planted.other_stamp);
    const Keyframe* b = keyframe_at(to, planted.robot, planted.stamp);
    if (a == nullptr || b == nullptr) return std::nullopt;
    const auto T_a_b = closures_.true_relative_pose(planted.other, a->stamp, planted.robot, b->stamp);
    if (!T_a_b) return std::nullopt;
    return LoopClosure{
        {from.id.chain, a->index}, {to.id.chain, b->index}, {planted.T_claimed_true * *T_a_b, covariance_}};
  };
  for (const PlantedClosure& planted : planted_) {
    if (const auto found = claim(planted, first, second)) return found;
    const auto backwards = claim(planted, second, first);
    if (!backwards) continue;
    return LoopClosure{backwards->to, backwards->from, {backwards->measurement.T_a_b.inverse(), covariance_}};
  }
  return std::nullopt;
}

namespace {

std::vector<PlantedClosure> planted_closures(const std::vector<PlantedClosureConfig>& configs,
                                             const std::vector<MissionRecording>& recordings) {
  const auto moment = [&](const std::string& name, double time_s) {
    const auto found = std::ranges::find(recordings, name, [](const MissionRecording& r) { return r.recording.name; });
    TUTTI_CHECK(found != recordings.end(), "no robot is called '{}'", name);
    return std::pair(found->recording.robot, found->recording.odometry.front().stamp + (time_s - found->start_s));
  };
  std::vector<PlantedClosure> out;
  for (const PlantedClosureConfig& config : configs) {
    const auto [robot, stamp] = moment(config.robot, config.at_s);
    const auto [other, other_stamp] = moment(config.other.empty() ? config.robot : config.other, config.other_at_s);
    const Pose3 error{so3_exp(config.yaw_deg * kRadPerDeg * Eigen::Vector3d::UnitZ()),
                      {config.ahead_m, config.left_m, 0.0}};
    out.push_back({robot, stamp, other, other_stamp, error});
  }
  return out;
}

std::shared_ptr<const server::ClosureFinder> make_reference_finder(const ClosureConfig& config,
                                                                   const std::vector<MissionRecording>& recordings,
                                                                   std::uint64_t seed) {
  std::map<RobotId, Trajectory> reference;
  for (const MissionRecording& robot : recordings) reference[robot.recording.robot] = robot.recording.reference;
  return std::make_shared<ReferenceClosureFinder>(std::move(reference), config.reference, seed,
                                                  planted_closures(config.planted, recordings));
}

/// Of the recordings that the finder's answers depend on, in short.
std::string extent_of(const ClosureConfig& config, const std::vector<MissionRecording>& recordings) {
  std::string out;
  if (config.finder != "reference") return out;
  for (const MissionRecording& robot : recordings) {
    const Trajectory& reference = robot.recording.reference;
    out += fmt::format("{} {}\n", robot.recording.robot.value, reference.size());
    if (!reference.empty()) out += fmt::format("{} {}\n", reference.front().stamp.ns, reference.back().stamp.ns);
  }
  return out;
}

}  // namespace

VisualClosureFinder::VisualClosureFinder(const visual::VisualClosureConfig& config, int min_submap_gap,
                                         std::size_t cache_bytes)
    : config_(config), min_submap_gap_(static_cast<std::uint32_t>(min_submap_gap)), cache_(cache_bytes) {}

bool VisualClosureFinder::is_candidate(const Submap& first, const Submap& second) const {
  return visual::is_candidate(first, second, min_submap_gap_, config_);
}

Result<ClosureVerdict> VisualClosureFinder::verify(const Submap& first, const Submap& second,
                                                   const server::PayloadStore& payloads) const {
  const auto a = features_of(first, payloads);
  if (!a) return tl::unexpected(a.error());
  const auto b = features_of(second, payloads);
  if (!b) return tl::unexpected(b.error());
  ClosureVerdict verdict = visual::verify_pair(**a, **b, config_);
  verdict.finder = id();
  return verdict;
}

Result<VisualClosureFinder::Features> VisualClosureFinder::features_of(const Submap& submap,
                                                                       const server::PayloadStore& payloads) const {
  return cache_.get(submap.id, [&]() -> Result<Features> {
    auto payload = payloads.visual(submap.id);
    if (!payload) return tl::unexpected(payload.error());
    Submap seen = submap;
    seen.visual = std::move(*payload);
    return std::make_shared<const visual::SubmapFeatures>(visual::extract_features(seen, config_));
  });
}

JointClosureFinder::JointClosureFinder(std::vector<std::shared_ptr<const server::ClosureFinder>> finders)
    : finders_(std::move(finders)) {}

bool JointClosureFinder::can_compare(const PayloadSize& first, const PayloadSize& second) const {
  return std::ranges::any_of(finders_, [&](const auto& finder) { return finder->can_compare(first, second); });
}

bool JointClosureFinder::is_candidate(const Submap& first, const Submap& second) const {
  return std::ranges::any_of(finders_, [&](const auto& finder) { return finder->is_candidate(first, second); });
}

Result<ClosureVerdict> JointClosureFinder::verify(const Submap& first, const Submap& second,
                                                  const server::PayloadStore& payloads) const {
  ClosureVerdict out{.pair = {first.id, second.id}, .finder = id()};
  for (const auto& finder : finders_) {
    if (!finder->is_candidate(first, second)) continue;
    auto verdict = finder->verify(first, second, payloads);
    if (!verdict) return verdict;
    std::ranges::move(verdict->closures, std::back_inserter(out.closures));
    std::ranges::move(verdict->evidence, std::back_inserter(out.evidence));
    // Of a submap without a payload of the kind it says no more than that.
    if (!out.refusal || out.refusal->reason == RefusalReason::too_small) out.refusal = verdict->refusal;
  }
  if (!out.closures.empty()) out.refusal.reset();
  return out;
}

std::shared_ptr<const server::ClosureFinder> make_closure_finder(const ClosureConfig& config,
                                                                 const std::vector<MissionRecording>& recordings,
                                                                 std::uint64_t seed) {
  std::shared_ptr<const server::ClosureFinder> finder;
  const auto cache_bytes = static_cast<std::size_t>(config.feature_cache_mb * 1e6);
  const auto lidar = [&] {
    return std::make_shared<LidarClosureFinder>(config.lidar, config.min_submap_gap, cache_bytes);
  };
  const auto visual = [&] {
    return std::make_shared<VisualClosureFinder>(config.visual, config.min_submap_gap, cache_bytes);
  };
  if (config.finder == "lidar")
    finder = lidar();
  else if (config.finder == "visual")
    finder = visual();
  else if (config.finder == "sensors")
    finder = std::make_shared<JointClosureFinder>(
        std::vector<std::shared_ptr<const server::ClosureFinder>>{lidar(), visual()});
  else
    finder = make_reference_finder(config, recordings, seed);
  MethodId id = finder->id();
  if (config.wrong_share > 0.0)
    finder = std::make_shared<SpoiledClosureFinder>(std::move(finder), config.wrong_share, config.wrong, seed);
  std::string settings = settings_of(config, seed);
  id.settings = settings_hash(settings + extent_of(config, recordings));
  if (config.finder == "reference") settings.clear();
  return std::make_shared<NamedFinder>(std::move(finder), std::move(id), std::move(settings));
}

}  // namespace tutti::mission
