// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/incarnation.hpp"

#include <unistd.h>

#include <chrono>
#include <limits>

#include "tutti/base/random.hpp"
#include "tutti/program/clock.hpp"

namespace tutti::program {

/// Not of the clock alone, which a base station may not have.
std::uint32_t any_incarnation() {
  const auto since_boot = static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
  const Rng rng = Rng(wall_clock_ns()).fork(static_cast<std::uint64_t>(getpid())).fork(since_boot);
  return static_cast<std::uint32_t>(1 + Rng(rng).index(std::numeric_limits<std::uint32_t>::max() - 1));
}

}  // namespace tutti::program
