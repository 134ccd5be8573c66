// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/verifiers/parallel.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace tutti::verifiers {
namespace parallel_test {

TEST(ForEachParallel, DoesEveryTaskOnce) {
  for (const std::size_t count : {0U, 1U, 2U, 1000U})
    for (const std::size_t threads : {1U, 2U, 7U}) {
      std::vector<int> done(count, 0);
      for_each_parallel(count, threads, [&](std::size_t i) { ++done[i]; });
      EXPECT_EQ(done, std::vector<int>(count, 1));
    }
}

TEST(ForEachParallel, AnExceptionReachesTheCaller) {
  for (const std::size_t threads : {1U, 4U})
    EXPECT_THROW(for_each_parallel(100, threads,
                                   [](std::size_t i) {
                                     if (i == 50) throw std::runtime_error("task 50");
                                   }),
                 std::runtime_error);
}

}  // namespace parallel_test
}  // namespace tutti::verifiers
