// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>

#include "tutti/consistency/internal/links.hpp"
#include "tutti/consistency/internal/policies.hpp"

namespace tutti::consistency::internal {

Selection UniformPolicy::choose(const PolicyInput& input) const {
  LinkCollector collector(input, true);
  const std::size_t nodes = input.comparison.pairs.size();
  if (nodes < 2) return std::move(collector).take();
  const std::size_t links =
      std::min(input.budget.value_or(static_cast<std::size_t>(config_.default_budget)), nodes - 1);
  const auto end = [&](std::size_t link) { return (link * (nodes - 1) + links / 2) / links; };  // rounded
  for (std::size_t link = 0; link < links; ++link) collector.add({end(link), end(link + 1)}, ConstraintKind::other);
  return std::move(collector).take();
}

}  // namespace tutti::consistency::internal
