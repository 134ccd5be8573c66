// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace tutti {

/// While alive, the calling thread's OpenMP regions run on this thread alone, and OpenBLAS, if it is in the process,
/// uses no threads of its own. Whoever calls BLAS, LAPACK or CHOLMOD holds one: our matrices are small, so that waiting
/// for a team costs more than it saves (CHOLMOD opens a region for every supernode, tens of columns each), and results
/// must not depend, to the bit, on how many threads there are.
///
/// The OpenMP setting belongs to the calling thread. OpenBLAS's number belongs to the process: the first that is alive
/// sets it to 1, the last one alive restores it, so any number of threads may hold one at once; somebody else's BLAS
/// calls run on one thread meanwhile, and nobody else may set the number then.
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
