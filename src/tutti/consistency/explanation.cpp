// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/explanation.hpp"

#include <algorithm>
#include <cmath>

#include "tutti/consistency/internal/drift_origins.hpp"
#include "tutti/consistency/time_chain.hpp"

namespace tutti::consistency {
namespace {

/// The scale that speaks of this length.
int scale_of(const std::vector<double>& scale_length_m, double length_m) {
  const auto apart = [&](double scale_m) { return std::abs(std::log(scale_m / std::max(length_m, 1e-3))); };
  const auto best = std::ranges::min_element(scale_length_m, {}, apart);
  return static_cast<int>(best - scale_length_m.begin());
}

}  // namespace

Explanation explain(const ProxyGraph& graph, const ChainId& id, std::span<const RobotNode> nodes,
                    std::span<const NodePair> pairs, const DisagreementTest& test, Disagreement found,
                    double false_alarm_rate) {
  Explanation out;
  const TimeChain chain = time_chain(graph, nodes, pairs);
  const ChainUncertainty* uncertainty = uncertainty_of(graph, id);
  const std::vector<Pose3> odometry = odometry_at(nodes, pairs);
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    out.stamps.push_back(nodes[pairs[k].robot].stamp);
    out.distance_m.push_back(
        k == 0 ? 0.0 : out.distance_m.back() + (chain.server[k].translation - chain.server[k - 1].translation).norm());
  }
  for (int s = 0; s < test.scales(); ++s) out.scale_length_m.push_back(test.scale_length_m(s));
  out.direction_significance = found.direction_significance;
  out.position_m = std::move(found.position_m);
  out.rotation_rad = std::move(found.rotation_rad);
  out.significance = std::move(found.significance);
  out.aligned_rmse_m = aligned_rmse(chain.server, odometry);
  if (uncertainty != nullptr) out.expected_rmse_m = uncertainty->whole.position_m;
  if (!out.disagrees()) return out;  // nothing was born anywhere
  for (const internal::DriftSegment& segment :
       internal::drift_segments(chain, out.scale_length_m, uncertainty, false_alarm_rate)) {
    const auto relative = [&](const std::vector<Pose3>& poses) {
      return poses[segment.first].inverse() * poses[segment.last];
    };
    const Vector6d missed = local(relative(chain.server), relative(odometry));
    const double length_m = out.distance_m[segment.last] - out.distance_m[segment.first];
    const NodePair& middle = pairs[(segment.first + segment.last) / 2];
    out.origins.push_back({.from = out.stamps[segment.first],
                           .until = out.stamps[segment.last],
                           .place_m = graph.nodes[middle.proxy].T_world_body.translation,
                           .scale = scale_of(out.scale_length_m, length_m),
                           .length_m = length_m,
                           .translation_m = missed.head<3>().norm(),
                           .rotation_rad = missed.tail<3>().norm(),
                           .significance = segment.significance,
                           .alert = segment.alert});
  }
  return out;
}

}  // namespace tutti::consistency
