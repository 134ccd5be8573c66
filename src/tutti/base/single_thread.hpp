// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tutti {

/// While alive, the calling thread's OpenMP regions run on this thread alone, and OpenBLAS, if it is in the process,
/// uses no threads of its own. Every call of BLAS, LAPACK or CHOLMOD in Tutti is made under one: the matrices are
/// small, so waiting for a team of threads costs more than the team saves (CHOLMOD opens a region for every supernode,
/// tens of columns each), and results must not depend, to the bit, on the number of threads.
///
/// The OpenMP setting belongs to the calling thread. OpenBLAS's number of threads belongs to the process: the first
/// SingleThread alive sets it to 1 and the last one restores it, so any number of threads may hold one at once. Other
/// BLAS calls of the process run on one thread meanwhile, and nothing else may set that number then.
class SingleThread {
 public:
  SingleThread();
  ~SingleThread();
  SingleThread(const SingleThread&) = delete;
  SingleThread& operator=(const SingleThread&) = delete;

 private:
  int active_levels_ = 0;
};

}  // namespace tutti
