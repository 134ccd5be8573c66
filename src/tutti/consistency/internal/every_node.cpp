// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/links.hpp"
#include "tutti/consistency/internal/policies.hpp"

namespace tutti::consistency::internal {

Selection EveryNodePolicy::choose(const PolicyInput& input) const {
  PolicyInput unlimited = input;
  unlimited.budget.reset();
  LinkCollector collector(unlimited, true);
  const std::size_t nodes = input.comparison.pairs.size();
  for (std::size_t i = 0; i < nodes; ++i)
    for (std::size_t hop = 1; hop <= static_cast<std::size_t>(reach_) && i + hop < nodes; ++hop)
      collector.add({i, i + hop}, ConstraintKind::other);
  return std::move(collector).take();
}

}  // namespace tutti::consistency::internal
