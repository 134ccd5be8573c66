// SPDX-License-Identifier: BSD-3-Clause
// The one main of every test: the same random sequence at every run, and a word ctest turns into "Skipped" when a test
// file had nothing to do (no ../shared beside the checkout). --tutti_file=src/tutti/base/ids_test.cpp runs only the
// tests of that file.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include "support/sanitized.hpp"

namespace {

template <class F>
void for_each_test(F&& visit) {
  const auto& unit = *::testing::UnitTest::GetInstance();
  for (int s = 0; s < unit.total_test_suite_count(); ++s) {
    const auto& suite = *unit.GetTestSuite(s);
    for (int t = 0; t < suite.total_test_count(); ++t) visit(*suite.GetTestInfo(t));
  }
}

/// GoogleTest's filter for the tests that are written in `file`; empty when there are none.
std::string filter_of(std::string_view file) {
  std::string filter;
  for_each_test([&](const ::testing::TestInfo& test) {
    // ccache may have made the path relative to the build folder; what follows the checkout's own folder stays.
    if (!std::string_view(test.file()).ends_with(file)) return;
    if (!filter.empty()) filter += ':';
    filter.append(test.test_suite_name()).append(".").append(test.name());
  });
  return filter;
}

/// A test in any other file would be in no ctest entry.
bool all_in_test_files() {
  bool all = true;
  for_each_test([&](const ::testing::TestInfo& test) {
    if (std::string_view(test.file()).ends_with("_test.cpp")) return;
    std::printf("%s.%s is in %s, which is no *_test.cpp\n", test.test_suite_name(), test.name(), test.file());
    all = false;
  });
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  // RapidCheck; 0 = do not override the user's
  setenv("RC_PARAMS", tutti::kSanitized ? "seed=2026 max_success=20" : "seed=2026", 0);
  ::testing::InitGoogleTest(&argc, argv);
  if (!all_in_test_files()) return 1;
  constexpr std::string_view kFile = "--tutti_file=";
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (!argument.starts_with(kFile)) {
      std::printf("unknown argument %s\n", argv[i]);
      return 1;
    }
    const std::string filter = filter_of(argument.substr(kFile.size()));
    if (filter.empty()) {
      std::printf("%s: no test is written there\n", argv[i]);
      return 1;
    }
    GTEST_FLAG_SET(filter, filter);
  }
  const int code = RUN_ALL_TESTS();
  const auto& unit = *::testing::UnitTest::GetInstance();
  if (code == 0 && unit.skipped_test_count() > 0 && unit.skipped_test_count() == unit.test_to_run_count())
    std::puts("TUTTI_ALL_SKIPPED");
  return code;
}
