// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/map_fetcher.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "support/bus/nats_network.hpp"
#include "support/publishing/publications.hpp"
#include "tutti/base/file.hpp"
#include "tutti/bus/transport.hpp"

namespace tutti::program {
namespace map_fetcher_test {

class MapFetcherTest : public publishing::test::Publications {
 protected:
  [[nodiscard]] std::unique_ptr<bus::MapBoard> board() const {
    const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
    return bus::open_maps({.url = "memory://" + name, .mission = "cave"}).value();
  }
  /// Its `open_map` notes what it was asked for, and refuses what begins with an 'x'.
  [[nodiscard]] std::unique_ptr<MapFetcher> start() {
    return std::make_unique<MapFetcher>(
        board(), publishing::KeptMaps(folder_ / "maps", alpha_),
        [this](const std::filesystem::path& file) -> Result<LocaliseSetup> {
          const std::string text = read_file(file.string()).value();
          if (text[1] == 'x') return fail(ErrorCode::invalid, "of another version");
          opened_ = text;
          return std::make_shared<const localise::Localiser::Setup>();
        },
        *log_);
  }
  void publish_map(const std::string& file) {
    ASSERT_TRUE(publishing::publish(*board(), file, {.map = "0a1b", .version = 7}, anna_, 1).has_value());
  }
  std::unique_ptr<EventLog> log_ = EventLog::on_console("robot", Level::error);
  std::string opened_;
};

TEST_F(MapFetcherTest, TakesWhatIsPublishedAndHasItAtOnceAfterAStart) {
  {
    const auto fetcher = start();
    EXPECT_TRUE(tutti::test::within(5.0, [&] { return !fetcher->state().empty(); }));
    EXPECT_EQ(fetcher->state(), "no map is published to this mission yet");
    EXPECT_EQ(fetcher->take(), nullptr);
  }
  publish_map(file_of(2));
  {
    const auto fetcher = start();
    EXPECT_TRUE(tutti::test::within(10.0, [&] { return fetcher->has_news(); }));
    EXPECT_NE(fetcher->take(), nullptr);
    EXPECT_FALSE(fetcher->has_news());
  }
  EXPECT_EQ(opened_, file_of(2));
  opened_.clear();
  const auto fetcher = start();
  EXPECT_NE(fetcher->take(), nullptr);  // without waiting for the bus
  EXPECT_EQ(opened_, file_of(2));
}

TEST_F(MapFetcherTest, AMapThatCannotBeOpenedLeavesTheOneBefore) {
  publish_map(file_of(2));
  EXPECT_TRUE(tutti::test::within(10.0, [fetcher = start()] { return fetcher->has_news(); }));
  publish_map(file_of(2, 'x'));
  {
    const auto fetcher = start();
    EXPECT_NE(fetcher->take(), nullptr);
    EXPECT_TRUE(
        tutti::test::within(10.0, [&] { return fetcher->state().find("of another version") != std::string::npos; }));
    EXPECT_FALSE(fetcher->has_news());
  }
  opened_.clear();
  EXPECT_NE(start()->take(), nullptr);
  EXPECT_EQ(opened_, file_of(2));
}

TEST_F(MapFetcherTest, WhatNobodyHasSignedIsSaidAndNotTaken) {
  ASSERT_TRUE(publishing::publish(*board(), file_of(2), {.map = "0a1b"}, {}, 1).has_value());
  const auto fetcher = start();
  EXPECT_TRUE(
      tutti::test::within(10.0, [&] { return fetcher->state().find("nobody has signed") != std::string::npos; }));
  EXPECT_FALSE(fetcher->has_news());
}

}  // namespace map_fetcher_test
}  // namespace tutti::program
