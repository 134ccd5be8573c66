// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/explanation.hpp"

#include <algorithm>
#include <cmath>

#include "tutti/consistency/internal/drift_origins.hpp"
#include "tutti/consistency/internal/time_chain.hpp"

namespace tutti::consistency {
namespace {

std::vector<Pose3> composed(const std::vector<RelativePose>& odometry) {
  std::vector<Pose3> poses{Pose3{}};
  for (std::size_t k = 1; k < odometry.size(); ++k) poses.push_back(poses.back() * odometry[k].T_a_b);
  return poses;
}

/// The scale that speaks of this length, in nodes.
int scale_of(const ChainAgreement& test, double nodes) {
  int best = 0;
  for (int s = 1; s < test.scales(); ++s)
    if (std::abs(std::log(test.scale_length(s) / nodes)) < std::abs(std::log(test.scale_length(best) / nodes)))
      best = s;
  return best;
}

}  // namespace

Explanation explain(const ProxyGraph& graph, const ChainId& id, std::span<const RobotNode> nodes,
                    std::span<const NodePair> pairs, std::uint64_t update, const AgreementConfig& config) {
  Explanation out;
  if (pairs.size() < 2) return out;
  const internal::TimeChain chain = internal::time_chain(graph, id, nodes, pairs);
  const ShapeUncertainty* shape = internal::shape_of(graph, id);
  const ChainAgreement test(chain.ranks, shape, update, config);
  const std::vector<Pose3> odometry = composed(chain.odometry);
  ChainDisagreement raw = test.compare(chain.server, odometry);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    out.stamps.push_back(nodes[pairs[k].robot].stamp);
    out.distance_m.push_back(
        k == 0 ? 0.0 : out.distance_m.back() + (chain.server[k].translation - chain.server[k - 1].translation).norm());
  }
  const double spacing = out.distance_m.back() / static_cast<double>(pairs.size() - 1);
  for (int s = 0; s < test.scales(); ++s) out.scale_length_m.push_back(test.scale_length(s) * spacing);
  out.scale_significance.assign(raw.scale_significance.begin(), raw.scale_significance.end());
  out.position_m = std::move(raw.position_m);
  out.rotation_rad = std::move(raw.rotation_rad);
  out.significance = std::move(raw.significance);
  for (const MissedTie& tie : raw.missed_ties)
    out.missed_ways.push_back({.from = out.stamps[tie.a],
                               .until = out.stamps[tie.b],
                               .length_m = out.distance_m[tie.b] - out.distance_m[tie.a],
                               .translation_m = tie.position_m,
                               .rotation_rad = tie.rotation_rad,
                               .significance = tie.significance});
  out.aligned_rmse_m = internal::aligned_rmse(chain.server, odometry);
  if (shape != nullptr) out.expected_rmse_m = shape->whole.position_m;
  if (!out.disagrees()) return out;  // nothing was born anywhere
  for (const internal::DriftStretch& stretch : internal::drift_stretches(chain, shape, config.false_alarm_rate)) {
    const auto relative = [&](const std::vector<Pose3>& poses) {
      return poses[stretch.first].inverse() * poses[stretch.last];
    };
    const Vector6d missed = local(relative(chain.server), relative(odometry));
    const NodePair& middle = pairs[(stretch.first + stretch.last) / 2];
    out.origins.push_back({.from = out.stamps[stretch.first],
                           .until = out.stamps[stretch.last],
                           .place_m = graph.nodes[middle.proxy].T_world_body.translation,
                           .scale = scale_of(test, static_cast<double>(stretch.last - stretch.first)),
                           .length_m = out.distance_m[stretch.last] - out.distance_m[stretch.first],
                           .translation_m = missed.head<3>().norm(),
                           .rotation_rad = missed.tail<3>().norm(),
                           .significance = stretch.significance,
                           .alert = stretch.alert});
  }
  return out;
}

}  // namespace tutti::consistency
