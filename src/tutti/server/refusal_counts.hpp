// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <map>

#include "tutti/base/ids.hpp"
#include "tutti/model/refusal.hpp"

namespace tutti::server {

/// The pairs that were refused for one reason.
struct RefusalCount {
  std::size_t intra = 0;  ///< Both submaps are of one robot.
  std::size_t inter = 0;  ///< They are of two robots.
  Refusal nearest;        ///< The refusal that missed its limit by least, where something is measured.
  friend bool operator==(const RefusalCount&, const RefusalCount&) = default;
};

using RefusalCounts = std::map<RefusalReason, RefusalCount>;

/// Counts one more refusal, of a pair of submaps of robots `a` and `b`.
inline void count_refusal(const Refusal& refusal, RobotId a, RobotId b, RefusalCounts& counts) {
  RefusalCount& entry = counts.try_emplace(refusal.reason, RefusalCount{.nearest = refusal}).first->second;
  ++(a == b ? entry.intra : entry.inter);
  const auto miss = [](const Refusal& r) { return std::abs(r.value - r.limit); };
  if (is_measured(refusal) && (!is_measured(entry.nearest) || miss(refusal) < miss(entry.nearest)))
    entry.nearest = refusal;
}

}  // namespace tutti::server
