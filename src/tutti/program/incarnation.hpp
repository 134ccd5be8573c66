// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

namespace tutti::program {

/// A number of this start of the program and, but for one in 4e9 times, of no other. Never 0 nor the largest, so that
/// an endpoint may have it: the server's own worker is 0, and the largest is any worker or all viewers.
std::uint32_t any_incarnation();

}  // namespace tutti::program
