// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/update_pacer.hpp"

#include <algorithm>

namespace tutti::node {

Timestamp UpdatePacer::earliest(Timestamp now, bool operator_decided) {
  if (!last_) return now;
  last_->begun = std::min(last_->begun, now);
  const double wait_s = operator_decided ? limits_.least_s : std::max(limits_.least_s, last_->cost_s / limits_.share);
  return std::max(now, last_->begun + wait_s);
}

}  // namespace tutti::node
