// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/throttle.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tutti/program/event_log.hpp"

namespace tutti::program {
namespace throttle_test {

TEST(Throttle, LetsABurstThroughThenOneATimeAndCountsTheRest) {
  Throttle throttle;
  const auto passed = [&](double begin_s, double end_s) {
    int count = 0;
    for (double s = begin_s; s < end_s; s += 0.01) count += throttle.ask("refused", s).passes ? 1 : 0;
    return count;
  };
  EXPECT_EQ(passed(0.0, 5.0), 20);
  EXPECT_TRUE(throttle.ask("other", 5.0).passes);
  EXPECT_NEAR(passed(5.0, 105.0), 10, 1);
  Throttle::Verdict verdict = throttle.ask("refused", 200.0);
  EXPECT_TRUE(verdict.passes);
  EXPECT_GT(verdict.left_out, 100U);
  verdict = throttle.ask("refused", 200.0);
  EXPECT_TRUE(verdict.passes);
  EXPECT_EQ(verdict.left_out, 0U);
}

TEST(Throttle, GarbageDoesNotFillTheLogs) {
  const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "garbage_does_not_fill";
  std::filesystem::create_directories(folder);
  {
    const auto log = EventLog::open(folder, "server", Level::error);
    ASSERT_TRUE(log.has_value()) << log.error().message;
    for (std::uint32_t i = 0; i < 10'000; ++i)
      (*log)->write(
          node::Event{{}, node::MessageRefused{bus::Endpoint::of(RobotId{i}), bus::MessageKind::submap, "no"}});
    (*log)->write(node::Event{{}, node::SubmapStored{}});
    for (int i = 0; i < 1000; ++i) (*log)->say(Level::error, "cannot store anything");
  }
  int lines = 0;
  ASSERT_TRUE(read_events(folder, [&](const Json&) { ++lines; }));
  EXPECT_EQ(lines, 21);
  EXPECT_LT(std::filesystem::file_size(folder / "log.txt"), 10'000U);
  std::filesystem::remove_all(folder);
}

}  // namespace throttle_test
}  // namespace tutti::program
