// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/single_thread.hpp"

#include <dlfcn.h>

#include <mutex>

namespace tutti {
namespace {

/// A function of the OpenMP runtime or the BLAS that is in the process, if any; looked up by name, so that this library
/// neither links one nor depends on which it is.
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

/// OpenBLAS's number of threads, and how many keep it at 1.
class BlasThreads {
 public:
  void hold() {
    const std::scoped_lock lock(mutex_);
    if (holders_++ > 0 || set_ == nullptr || get_ == nullptr) return;
    before_ = get_();
    if (before_ != 1) set_(1);
  }
  void release() {
    const std::scoped_lock lock(mutex_);
    if (--holders_ == 0 && before_ > 1) set_(before_);
  }

 private:
  void (*set_)(int) = find<void(int)>("openblas_set_num_threads");
  int (*get_)() = find<int()>("openblas_get_num_threads");
  std::mutex mutex_;
  int holders_ = 0;
  int before_ = 1;
};

BlasThreads& blas_threads() {
  static BlasThreads threads;
  return threads;
}

}  // namespace

SingleThread::SingleThread() : active_levels_(get_levels()) {
  set_levels(0);
  blas_threads().hold();
}
SingleThread::~SingleThread() {
  blas_threads().release();
  set_levels(active_levels_);
}

}  // namespace tutti
