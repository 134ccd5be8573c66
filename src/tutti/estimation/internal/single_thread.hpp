// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tutti::estimation::internal {

/// While alive, OpenMP regions entered by this thread run on this thread alone. CHOLMOD opens a parallel region with a
/// hard-wired thread count for every supernode, tens of columns each: waiting for the team made the factorisation of
/// sphere2500 2.5 times slower on two cores. The setting belongs to the calling thread; no other sees it.
class SingleThread {
 public:
  SingleThread();
  ~SingleThread();
  SingleThread(const SingleThread&) = delete;
  SingleThread& operator=(const SingleThread&) = delete;

 private:
  int active_levels_ = 0;
};

}  // namespace tutti::estimation::internal
