// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace tutti::mission {

/// Processor and number of threads in words, as far as the system reports them.
std::string machine_description();

/// Largest resident memory of this process so far, in 10^6 bytes; 0 where the system does not report it.
double peak_memory_mb();

}  // namespace tutti::mission
