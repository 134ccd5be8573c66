// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/update_pacer.hpp"

#include <algorithm>

namespace tutti::node {

Timestamp UpdatePacer::earliest(Timestamp now, bool operator_decided) {
  if (!begun_) return now;
  begun_ = std::min(*begun_, now);
  const double wait_s = operator_decided ? limits_.least_s : std::max(limits_.least_s, cost_s_ / limits_.share);
  return std::max(now, *begun_ + wait_s);
}

}  // namespace tutti::node
