// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/single_thread.hpp"

#include <dlfcn.h>

namespace tutti::estimation::internal {
namespace {

/// The OpenMP runtime that CHOLMOD brought into the process, if any; looked up by name, so that this library neither
/// links one nor depends on which it is.
template <class Function>
Function* find(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_DEFAULT, name));
}

void set_levels(int levels) {
  static auto* const set = find<void(int)>("omp_set_max_active_levels");
  if (set != nullptr) set(levels);
}

int get_levels() {
  static auto* const get = find<int()>("omp_get_max_active_levels");
  return get != nullptr ? get() : 1;
}

}  // namespace

SingleThread::SingleThread() : active_levels_(get_levels()) { set_levels(0); }
SingleThread::~SingleThread() { set_levels(active_levels_); }

}  // namespace tutti::estimation::internal
