// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/load_meter.hpp"

#include <ctime>

namespace tutti::mission {

double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace tutti::mission
