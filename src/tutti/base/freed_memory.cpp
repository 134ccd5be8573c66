// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/freed_memory.hpp"

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace tutti {

#ifdef __GLIBC__
namespace {
constexpr int kMost = 1 << 30;  // more than a map takes
}

void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, kMost);
  mallopt(M_TRIM_THRESHOLD, kMost);
}

void return_freed_memory() { malloc_trim(0); }
#else
void keep_freed_memory() {}
void return_freed_memory() {}
#endif

}  // namespace tutti
