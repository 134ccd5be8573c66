// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <map>

#include "tutti/base/ids.hpp"
#include "tutti/model/refusal.hpp"

namespace tutti::server {

/// Pairs refused for one reason.
struct RefusalCount {
  std::size_t intra = 0;  ///< Both submaps of one robot.
  std::size_t inter = 0;
  Refusal nearest;  ///< Where something is measured: the one that missed its limit by least.
  friend bool operator==(const RefusalCount&, const RefusalCount&) = default;
};

using RefusalCounts = std::map<RefusalReason, RefusalCount>;

inline void count_refusal(const Refusal& refusal, RobotId a, RobotId b, RefusalCounts& counts) {
  RefusalCount& entry = counts.try_emplace(refusal.reason, RefusalCount{.nearest = refusal}).first->second;
  ++(a == b ? entry.intra : entry.inter);
  const auto miss = [](const Refusal& r) { return std::abs(r.value - r.limit); };
  if (is_measured(refusal) && (!is_measured(entry.nearest) || miss(refusal) < miss(entry.nearest)))
    entry.nearest = refusal;
}

}  // namespace tutti::server
