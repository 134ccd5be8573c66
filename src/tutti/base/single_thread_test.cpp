// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/single_thread.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <thread>
#include <vector>

extern "C" void openblas_set_num_threads(int threads);
extern "C" int openblas_get_num_threads();

namespace tutti {
namespace single_thread_test {

class OpenBlas : public testing::Test {
 protected:
  OpenBlas() { openblas_set_num_threads(kUsers); }
  ~OpenBlas() override { openblas_set_num_threads(1); }
  static constexpr int kUsers = 3;  ///< As whoever uses the library has set it.
};

TEST_F(OpenBlas, HasOneThreadUntilTheLastHolderGoes) {
  std::optional<SingleThread> first(std::in_place);
  EXPECT_EQ(openblas_get_num_threads(), 1);
  std::optional<SingleThread> second(std::in_place);
  first.reset();
  EXPECT_EQ(openblas_get_num_threads(), 1);
  second.reset();
  EXPECT_EQ(openblas_get_num_threads(), kUsers);
}

TEST_F(OpenBlas, HasOneThreadInEveryHolderOfMany) {
  std::atomic<int> others = 0;
  std::vector<std::jthread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 2000; ++i) {
        const SingleThread single_thread;
        if (openblas_get_num_threads() != 1) ++others;
      }
    });
  threads.clear();
  EXPECT_EQ(others, 0);
  EXPECT_EQ(openblas_get_num_threads(), kUsers);
}

}  // namespace single_thread_test
}  // namespace tutti
