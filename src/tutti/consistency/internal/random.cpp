// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/links.hpp"
#include "tutti/consistency/internal/policies.hpp"

namespace tutti::consistency::internal {
namespace {

/// Draws per link wanted; a graph that yields less than one new link in so many draws has none left.
constexpr std::size_t kDrawsPerLink = 50;

}  // namespace

Selection RandomPolicy::choose(const PolicyInput& input) const {
  PolicyInput limited = input;
  if (!limited.budget) limited.budget = static_cast<std::size_t>(config_.default_budget);
  LinkCollector collector(limited, true);
  const std::size_t nodes = input.comparison.pairs.size();
  if (nodes < 2) return std::move(collector).take();
  const Neighbourhood neighbourhood(input, config_);
  constexpr ConstraintKind kKinds[] = {ConstraintKind::small, ConstraintKind::mid, ConstraintKind::large};
  for (std::size_t draw = 0; draw < kDrawsPerLink * *limited.budget && !collector.full(); ++draw) {
    const auto node = static_cast<std::size_t>(limited.rng.index(nodes));
    const ConstraintKind kind = kKinds[limited.rng.index(3)];
    collector.add(neighbourhood.links(node, kind), kind);
  }
  return std::move(collector).take();
}

}  // namespace tutti::consistency::internal
