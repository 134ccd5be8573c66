// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/place_record.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tutti/consistency/chain_uncertainty.hpp"
#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::node {
namespace {

/// How sure the localiser is of the places, along the worst direction, as the root of the mean square.
PoseSigma typical_sigma(const auto& places) {
  PoseSigma squares;
  for (const auto& place : places) {
    const Matrix6d& covariance = place.T_world_body.covariance;
    squares.position_m += covariance.diagonal().template head<3>().maxCoeff();
    squares.rotation_rad += covariance.diagonal().template tail<3>().maxCoeff();
  }
  const auto n = static_cast<double>(places.size());
  return {std::sqrt(squares.position_m / n), std::sqrt(squares.rotation_rad / n)};
}

}  // namespace

std::optional<StartPose> start_at(const StoredPlace& place, const localise::KnownMap& map) {
  constexpr double kSigma_m = 0.5, kSigma_rad = 10.0 * kRadPerDeg;
  const auto near = map.submaps.find(place.near);
  if (place.map != map.id || near == map.submaps.end()) return std::nullopt;
  return StartPose{.T_world_body = RelativePose{place.T_world_body, diagonal_covariance(kSigma_m, kSigma_rad)},
                   .floor = near->second.floor};
}

void PlaceRecord::note(const robot::RobotAgent& agent, const localise::Located& located,
                       const localise::KnownMap& map) {
  constexpr double kRecent_s = 5.0;  // a keyframe may be made this long after its time
  if (located.state == localise::State::lost)
    std::erase_if(places_, [&](const Place& place) { return located.stamp - place.stamp < kDoubted_s; });
  const auto& keyframes = agent.keyframes();
  seen_ = std::min(seen_, keyframes.size());  // a session has begun
  for (; seen_ < keyframes.size(); ++seen_) {
    const Keyframe keyframe = keyframes[seen_];
    const bool is_usable = located.state == localise::State::localised && keyframe.representative &&
                           located.stamp - keyframe.stamp < kRecent_s &&
                           (places_.empty() || places_.back().stamp < keyframe.stamp);
    if (!is_usable) continue;
    const Pose3 step = agent.T_odom_body().inverse() * keyframe.T_odom_body;
    const RelativePose& now = *located.T_world_body;
    const auto near = map.near({located.floor, now.T_a_b.translation}, std::numeric_limits<double>::infinity(), 1);
    if (!near.empty()) unstored_ = StoredPlace{map.id, now.T_a_b, near.front()};
    floor_ = located.floor;
    places_.push_back(
        {keyframe.stamp, {now.T_a_b * step, compound_covariance(step, now.covariance, Matrix6d::Zero())}});
  }
}

std::optional<ProxyGraphMessage> PlaceRecord::graph_if_due(const robot::RobotAgent& agent) {
  told_ = std::min(told_, places_.size());
  if (places_.size() < told_ + std::max(kLeastNew, told_ / 10)) return std::nullopt;
  told_ = places_.size();
  std::vector<consistency::ServerNode> nodes;
  for (const Place& place : places_) {
    const auto& [T, covariance] = place.T_world_body;
    Matrix6d since = Matrix6d::Zero();
    if (!nodes.empty()) {  // each place errs by itself
      const Place& before = places_[nodes.size() - 1];
      since = compound_covariance(before.T_world_body.T_a_b.inverse() * T, before.T_world_body.covariance, covariance);
    }
    nodes.push_back({.chain = agent.chain(), .stamp = place.stamp, .T_world_body = T, .covariance = since});
  }
  const auto [epoch, revision] = agent.map_age();
  ProxyGraphMessage out{
      .header = {},
      .graph = consistency::build_proxy_graph(revision + 1, std::move(nodes), {{agent.chain(), floor_ - 1}}, {})};
  out.graph.epoch = epoch;
  out.graph.uncertainties = {consistency::even_uncertainty(agent.chain(), places_.size(), typical_sigma(places_))};
  return out;
}

}  // namespace tutti::node
