// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/hosted_server.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <latch>
#include <memory>
#include <stdexcept>
#include <vector>

#include "support/node/submaps.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::program {
namespace hosted_server_test {

using bus::MessageKind;
const ChainId kAlpha{RobotId{0}, 7};

/// Brings what is put in, until it is acknowledged, and keeps what is sent.
class Post final : public bus::Port {
 public:
  Post(std::vector<bus::Envelope>& owed, std::vector<bus::Envelope>& sent) : owed_(owed), sent_(sent) {}
  Status send(bus::Envelope envelope) override {
    sent_.push_back(std::move(envelope));
    return {};
  }
  std::vector<bus::Received> receive() override {
    std::vector<bus::Received> out;
    for (std::uint64_t i = 0; i < owed_.size(); ++i) out.push_back({owed_[i], i});
    return out;
  }
  void acknowledge(std::uint64_t) override { owed_.clear(); }
  void still_busy(std::uint64_t) override {}

 private:
  std::vector<bus::Envelope>& owed_;
  std::vector<bus::Envelope>& sent_;
};

class HostedServerTest : public testing::Test {
 protected:
  std::unique_ptr<Host> host(const HostedServer::MakeMap& make_map) {
    Host::Parts parts;
    parts.store = &store_;
    parts.open_port = [this]() -> Result<std::unique_ptr<bus::Port>> { return std::make_unique<Post>(owed_, sent_); };
    parts.open_node = [this, make_map](bus::Port&) -> Result<std::unique_ptr<Hosted>> {
      auto node = node::ServerNode::open({kAlpha.robot}, std::make_shared<node::test::EvenVerifier>(), {}, 1, store_);
      return std::make_unique<HostedServer>(
          std::move(*node), store_, "1", [](const MissionStatus&) { return std::string(); }, is_over_, viewers_, clock_,
          make_map);
    };
    return std::make_unique<Host>(std::move(parts), clock_, *log_);
  }
  void bring(std::uint32_t index) { owed_.push_back(node::test::envelope(node::test::submap(kAlpha, index))); }
  /// Opens the server and gives it a submap, of which it begins a map.
  void begin_map(Host& server) {
    ASSERT_TRUE(server.open().has_value());
    bring(0);
    server.turn();
    wall_s_ += 10.0;
    server.turn();
  }
  [[nodiscard]] std::size_t sent(MessageKind kind) const {
    return static_cast<std::size_t>(std::ranges::count(sent_, kind, &bus::Envelope::kind));
  }
  [[nodiscard]] std::size_t stored() const { return store_.tables().at("submaps").size(); }

  double wall_s_ = 0.0;
  Clock clock_{1.0, 0.0, [this] { return wall_s_; }};
  std::unique_ptr<EventLog> log_ = EventLog::on_console("test", Level::error);
  storage::MemoryStore store_{storage::map_schema()};
  std::vector<bus::Envelope> owed_, sent_;
  bool is_over_ = false;
  std::vector<std::unique_ptr<MapViewer>> viewers_;
};

TEST_F(HostedServerTest, ReceiptsDoNotWaitForAMap) {
  std::latch begun(1), may_end(1);
  const auto server = host([&](node::MapTask task) {
    begun.count_down();
    may_end.wait();
    return node::make_map(std::move(task));
  });
  ASSERT_NO_FATAL_FAILURE(begin_map(*server));
  begun.wait();  // the map is being made, and stays so
  for (std::uint32_t i = 1; i < 4; ++i) {
    bring(i);
    server->turn();
    EXPECT_EQ(stored(), i + 1);
    EXPECT_EQ(sent(MessageKind::receipt), i + 1);
    EXPECT_TRUE(owed_.empty());
  }
  wall_s_ += 100.0;
  EXPECT_GT(server->turn(), 0.0);  // it does not spin
  EXPECT_EQ(sent(MessageKind::proxy_graph), 0U);
  EXPECT_EQ(server->hosted()->status(clock_.now()).at("has_map"), false);
  may_end.count_down();
  while (sent(MessageKind::proxy_graph) == 0) {
    server->wait(1.0);
    server->turn();
  }
  EXPECT_EQ(server->hosted()->status(clock_.now()).at("revision"), 1);
  EXPECT_EQ(server->hosted()->status(clock_.now()).at("has_news"), true);  // of three submaps
}

TEST_F(HostedServerTest, AMapThatIsBeingMadeIsSentBeforeItEnds) {
  const auto server = host(&node::make_map);
  ASSERT_NO_FATAL_FAILURE(begin_map(*server));
  const std::atomic<bool> stop = true;
  server->run(stop);
  EXPECT_EQ(sent(MessageKind::proxy_graph), 1U);
}

TEST_F(HostedServerTest, WhatMakingAMapThrowsIsReportedAndTriedAgainWhileSubmapsAreTaken) {
  std::atomic<int> tries = 0;
  const auto server = host([&](node::MapTask task) {
    if (++tries == 1) throw std::logic_error("no map");
    return node::make_map(std::move(task));
  });
  ASSERT_NO_FATAL_FAILURE(begin_map(*server));
  while (server->hosted() != nullptr) {
    server->wait(1.0);
    server->turn();
  }
  EXPECT_NE(server->trouble().find("no map"), std::string::npos);
  wall_s_ += 1.01 * Host::kReopen_s;
  server->turn();  // it is made again
  bring(1);
  server->turn();
  EXPECT_EQ(stored(), 2U);
  wall_s_ += 60.0;
  while (sent(MessageKind::proxy_graph) == 0) {
    server->turn();
    server->wait(1.0);
  }
  EXPECT_EQ(tries, 2);
}

}  // namespace hosted_server_test
}  // namespace tutti::program
