// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace tutti::program {

/// A number of this start of the program and, but for one in 4e9 times, of no other; never 0.
std::uint32_t any_incarnation();

}  // namespace tutti::program
