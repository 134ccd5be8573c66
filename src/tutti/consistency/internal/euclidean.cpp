// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>

#include "tutti/consistency/internal/links.hpp"
#include "tutti/consistency/internal/policies.hpp"

namespace tutti::consistency::internal {

Selection EuclideanPolicy::choose(const PolicyInput& input) const {
  LinkCollector collector(input, config_.constraint, false);
  const auto& pairs = input.comparison.pairs;
  if (pairs.size() < 2) return std::move(collector).take();

  const auto server = [&](std::size_t n) -> const Pose3& { return input.graph.nodes[pairs[n].proxy].T_world_body; };
  const auto robot = [&](std::size_t n) -> const Pose3& { return input.nodes[pairs[n].robot].T_map_body; };
  const Pose3 T_map_world = robot(0) * server(0).inverse();
  std::vector<std::pair<double, std::size_t>> ranking;  // distance, node
  for (std::size_t n = 0; n < pairs.size(); ++n)
    ranking.emplace_back((T_map_world * server(n).translation - robot(n).translation).norm(), n);
  std::stable_sort(ranking.begin(), ranking.end(), [](const auto& a, const auto& b) { return a.first > b.first; });

  const Neighbourhood neighbourhood(input, config_);
  for (const auto& [distance, node] : ranking) {
    if (collector.full() || (!input.budget && distance <= config_.euclidean_threshold_m)) break;
    collector.add(neighbourhood.links(node, ConstraintKind::small), ConstraintKind::small);
    collector.add(neighbourhood.links(node, ConstraintKind::mid), ConstraintKind::mid);
  }
  return std::move(collector).take();
}

}  // namespace tutti::consistency::internal
