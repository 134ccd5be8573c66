// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/throttle.hpp"

#include <algorithm>
#include <utility>

namespace tutti::program {

Throttle::Verdict Throttle::ask(const std::string& kind, double wall_s) {
  Kind& known = kinds_.try_emplace(kind, Kind{.since_s = wall_s}).first->second;
  known.tokens = std::min(kBurst, known.tokens + std::max(0.0, wall_s - known.since_s) / kPeriod_s);
  known.since_s = wall_s;
  if (known.tokens < 1.0) {
    ++known.left_out;
    return {};
  }
  known.tokens -= 1.0;
  return {.passes = true, .left_out = std::exchange(known.left_out, 0)};
}

}  // namespace tutti::program
