// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/update_cost.hpp"

namespace tutti::server {

double counted_cost_s(const MadeMap& made) {
  const auto nodes = static_cast<double>(made.map.nodes.size());
  const auto closures = static_cast<double>(made.map.closures.size());
  const auto factorisations = static_cast<double>(made.search.factorisations + made.monitor.factorisations);
  return 2e-5 * nodes + 4e-6 * closures * factorisations;
}

}  // namespace tutti::server
