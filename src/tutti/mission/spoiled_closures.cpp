// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/spoiled_closures.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::mission {
namespace {

constexpr std::uint32_t kBlock = 2;  // submaps of each robot that share one look-alike

Rng pair_rng(std::uint64_t seed, std::string_view purpose, SubmapId first, SubmapId second) {
  return Rng(seed).fork(purpose).fork(packed(first.chain, first.index)).fork(packed(second.chain, second.index));
}

/// Where the second submap is claimed to be, from where it is, in the frame of the block's shared keyframe.
std::optional<Pose3> draw_error(const SubmapPair& pair, double wrong_share, const SpoiledClosureConfig& config,
                                std::uint64_t seed) {
  const auto block = [](SubmapId id) { return SubmapId{id.chain, id.index / kBlock}; };
  const double in_block = wrong_share * config.agreeing_share;
  const double alone = (wrong_share - in_block) / (1.0 - in_block);  // together: exactly wrong_share
  Rng rng = pair_rng(seed, "spoiled block", block(pair.first), block(pair.second));
  if (!rng.bernoulli(in_block)) {
    rng = pair_rng(seed, "spoiled", pair.first, pair.second);
    if (!rng.bernoulli(alone)) return std::nullopt;
  }
  const double offset = rng.uniform(config.min_m, config.max_m);
  const double direction = rng.uniform(-std::numbers::pi, std::numbers::pi);
  const double turn = rng.uniform(-config.max_deg, config.max_deg) * kRadPerDeg;
  return Pose3{so3_exp(turn * Eigen::Vector3d::UnitZ()),
               {offset * std::cos(direction), offset * std::sin(direction), 0.0}};
}

/// Raw odometry of the keyframe that the submaps 2 n and 2 n + 1 share.
const Pose3& block_anchor(const Submap& submap) {
  const bool even = submap.id.index % kBlock == 0;
  return (even ? submap.keyframes.back() : submap.keyframes.front()).T_odom_body;
}

/// The keyframe next to a moment within this robot's submap; neighbouring submaps share no moment.
const Keyframe* keyframe_at(const Submap& submap, RobotId robot, Timestamp stamp) {
  const auto& keyframes = submap.keyframes;
  if (submap.id.chain.robot != robot || stamp < keyframes.front().stamp || keyframes.back().stamp <= stamp)
    return nullptr;
  return &*std::ranges::min_element(keyframes, {}, [&](const Keyframe& k) { return std::abs(k.stamp - stamp); });
}

}  // namespace

SpoiledClosureFinder::SpoiledClosureFinder(std::shared_ptr<const server::ClosureFinder> inner, double wrong_share,
                                           const SpoiledClosureConfig& config, std::uint64_t seed)
    : inner_(std::move(inner)), wrong_share_(wrong_share), config_(config), seed_(seed) {
  TUTTI_CHECK(config_.max_m >= config_.min_m, "wrong offsets {} .. {} m", config_.min_m, config_.max_m);
}

bool SpoiledClosureFinder::is_candidate(const Submap& first, const Submap& second) const {
  return inner_->is_candidate(first, second);
}

Result<ClosureVerdict> SpoiledClosureFinder::verify(const Submap& first, const Submap& second,
                                                    const server::CloudStore& clouds) const {
  auto verdict = inner_->verify(first, second, clouds);
  if (!verdict) return verdict;
  const auto error = draw_error(verdict->pair, wrong_share_, config_, seed_);
  if (!error) return verdict;
  for (LoopClosure& closure : verdict->closures) {
    const Pose3& T_odom_from = first.keyframes[closure.from.index - first.keyframes.front().index].T_odom_body;
    const Pose3 T_anchor_from = block_anchor(first).inverse() * T_odom_from;
    closure.measurement.T_a_b = T_anchor_from.inverse() * *error * T_anchor_from * closure.measurement.T_a_b;
  }
  return verdict;
}

PlantedClosureFinder::PlantedClosureFinder(std::shared_ptr<const server::ClosureFinder> inner,
                                           std::shared_ptr<const simulation::ReferenceClosures> truth,
                                           std::vector<PlantedClosure> planted, const Matrix6d& covariance)
    : inner_(std::move(inner)), truth_(std::move(truth)), planted_(std::move(planted)), covariance_(covariance) {}

std::optional<LoopClosure> PlantedClosureFinder::planted_in(const Submap& first, const Submap& second) const {
  const auto claim = [&](const PlantedClosure& planted, const Submap& from,
                         const Submap& to) -> std::optional<LoopClosure> {
    const Keyframe* a = keyframe_at(from, planted.other, planted.other_stamp);
    const Keyframe* b = keyframe_at(to, planted.robot, planted.stamp);
    if (a == nullptr || b == nullptr) return std::nullopt;
    const auto T_a_b = truth_->true_relative_pose(planted.other, a->stamp, planted.robot, b->stamp);
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

bool PlantedClosureFinder::is_candidate(const Submap& first, const Submap& second) const {
  return planted_in(first, second) || inner_->is_candidate(first, second);
}

Result<ClosureVerdict> PlantedClosureFinder::verify(const Submap& first, const Submap& second,
                                                    const server::CloudStore& clouds) const {
  const auto planted = planted_in(first, second);
  if (!planted) return inner_->verify(first, second, clouds);
  return ClosureVerdict{{first.id, second.id}, {*planted}, std::nullopt, version()};
}

}  // namespace tutti::mission
