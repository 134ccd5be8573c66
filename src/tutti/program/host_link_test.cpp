// SPDX-License-Identifier: BSD-3-Clause
// A host reports the state of its link, and begins anew.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tutti/base/file.hpp"
#include "tutti/program/host.hpp"

namespace tutti::program {
namespace host_link_test {

namespace fs = std::filesystem;

/// The bus is gone.
class DeadPort final : public bus::Port {
 public:
  Status send(bus::Envelope) override { return {}; }
  std::vector<bus::Received> receive() override { return {}; }
  void acknowledge(std::uint64_t) override {}
  void still_busy(std::uint64_t) override {}
  [[nodiscard]] bus::LinkState state() const override { return {.url = "nats://127.0.0.1:1"}; }
};

class Idler final : public Hosted {
 public:
  Answer start(Timestamp) override { return {}; }
  Answer receive(const bus::Received&, Timestamp) override { return {}; }
  [[nodiscard]] Json status(Timestamp) const override { return {{"line", "idle"}}; }
};

class HostLinkTest : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(host_.open().has_value()); }
  void TearDown() override { fs::remove(file_); }

  fs::path file_ = fs::path(testing::TempDir()) / ("host_link_" + std::to_string(getpid()) + ".json");
  std::string trouble_ = "the bus does not run: its disk is full";
  int opened_ = 0;
  Clock clock_;
  std::unique_ptr<EventLog> log_ = EventLog::on_console("test", Level::error);
  Host host_{{.open_port = [this]() -> Result<std::unique_ptr<bus::Port>> {
                ++opened_;
                return std::make_unique<DeadPort>();
              },
              .open_node = [](bus::Port&) -> Result<std::unique_ptr<Hosted>> { return std::make_unique<Idler>(); },
              .each_second = {},
              .status_file = file_,
              .trouble = [this] { return trouble_; }},
             clock_,
             *log_};
};

TEST_F(HostLinkTest, WhatTheProgramKnowsGoesBeforeWhatTheLinkLooksLike) {
  host_.turn();
  EXPECT_EQ(host_.all_trouble(), trouble_);
  EXPECT_EQ(Json::parse(read_file(file_.string()).value()).value("trouble", ""), trouble_);
  trouble_.clear();
  EXPECT_EQ(host_.all_trouble(), "");  // of a link that is away for a short time
}

TEST_F(HostLinkTest, BeginsAnewWhenAsked) {
  EXPECT_EQ(opened_, 1);
  host_.start_anew();
  host_.turn();
  EXPECT_EQ(host_.hosted(), nullptr);
  EXPECT_TRUE(host_.tries_again());  // after Host::kReopen_s
  EXPECT_FALSE(host_.link().has_value());
}

}  // namespace host_link_test
}  // namespace tutti::program
