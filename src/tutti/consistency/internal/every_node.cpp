// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/policies.hpp"
#include "tutti/consistency/links.hpp"

namespace tutti::consistency::internal {

Selection EveryNodePolicy::choose(const PolicyInput& input) const {
  LinkCollector collector(input, true);
  for (std::size_t i = 1; i < input.pairs.size(); ++i) collector.add({i - 1, i}, ConstraintKind::other);
  return std::move(collector).take();
}

}  // namespace tutti::consistency::internal
