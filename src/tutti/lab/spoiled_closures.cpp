// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/spoiled_closures.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/simulation/reference_closures.hpp"

namespace tutti::lab {
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
  const double offset = rng.uniform(simulation::kWrongLeast_m, simulation::kWrongMost_m);
  const double direction = rng.uniform(-std::numbers::pi, std::numbers::pi);
  const double turn = rng.uniform(-simulation::kWrongTurn_deg, simulation::kWrongTurn_deg) * kRadPerDeg;
  return Pose3{so3_exp(turn * Eigen::Vector3d::UnitZ()),
               {offset * std::cos(direction), offset * std::sin(direction), 0.0}};
}

/// Raw odometry of the keyframe that the submaps 2 n and 2 n + 1 share.
const Pose3& block_anchor(const Submap& submap) {
  const bool even = submap.id.index % kBlock == 0;
  return (even ? submap.keyframes.back() : submap.keyframes.front()).T_odom_body;
}

}  // namespace

SpoiledClosureVerifier::SpoiledClosureVerifier(std::shared_ptr<const server::ClosureVerifier> inner, double wrong_share,
                                               const SpoiledClosureConfig& config, std::uint64_t seed)
    : WrappedVerifier(std::move(inner)), wrong_share_(wrong_share), config_(config), seed_(seed) {}

Result<ClosureVerdict> SpoiledClosureVerifier::verify(const Submap& first, const Submap& second,
                                                      const server::PayloadStore& payloads) const {
  auto verdict = wrapped().verify(first, second, payloads);
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

}  // namespace tutti::lab
