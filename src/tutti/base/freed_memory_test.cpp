// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/freed_memory.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstddef>
#include <vector>

#include "support/sanitized.hpp"

namespace tutti {
namespace freed_memory_test {

constexpr std::size_t kBytes = 16U << 20U;

/// Pages that the system had to give for so many rounds of taking and freeing.
long pages_of_rounds(int rounds) {
  const auto given = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_minflt;
  };
  const long before = given();
  for (int round = 0; round < rounds; ++round) {
    const std::vector<char> taken(kBytes, static_cast<char>(round));
    EXPECT_EQ(taken[kBytes / 2], static_cast<char>(round));
  }
  return given() - before;
}

TEST(FreedMemory, IsTakenAgainWithoutNewPagesUntilItIsReturned) {
  if (kSanitized) GTEST_SKIP() << "has an allocator of its own";
  keep_freed_memory();
  pages_of_rounds(1);
  const long pages = static_cast<long>(kBytes) / sysconf(_SC_PAGESIZE);
  EXPECT_LT(pages_of_rounds(20), pages);
  return_freed_memory();
  EXPECT_LT(pages_of_rounds(20), 3 * pages);  // they come once
}

}  // namespace freed_memory_test
}  // namespace tutti
