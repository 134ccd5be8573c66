// SPDX-License-Identifier: BSD-3-Clause
// The one main of every test: the same random sequence at every run, and a word ctest turns into "Skipped" when a test
// file had nothing to do (no ../shared beside the checkout).
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>

int main(int argc, char** argv) {
  setenv("RC_PARAMS", "seed=2026", 0);  // RapidCheck; 0 = do not override the user's
  ::testing::InitGoogleTest(&argc, argv);
  const int code = RUN_ALL_TESTS();
  const auto& unit = *::testing::UnitTest::GetInstance();
  if (code == 0 && unit.skipped_test_count() > 0 && unit.skipped_test_count() == unit.test_to_run_count())
    std::puts("TUTTI_ALL_SKIPPED");
  return code;
}
