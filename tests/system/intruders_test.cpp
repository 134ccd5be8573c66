// SPDX-License-Identifier: BSD-3-Clause
// A whole mission with rights, by its programs in one process, while intruders try everything: the map is that of nodes
// that talk to each other directly, and the server's log shows who tried what.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/lab/small_mission.hpp"
#include "tutti/base/file.hpp"
#include "tutti/bus/internal/nats_connection.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/pki/pki.hpp"
#include "tutti/program/robot_program.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/program/worker_program.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti {
namespace intruders_system_test {

namespace fs = std::filesystem;
using bus::BusRole;
using test::kNames;
using test::kPatience_s;
using test::Running;
using test::within;

constexpr double kRate = 25.0;
const std::string kMission = "small";

class IntrudersSystem : public ::testing::Test {
 protected:
  void SetUp() override {
    TUTTI_SKIP_WITHOUT_NATS_SERVER();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    pki_.emplace(pki::Pki::make(folder_ / "pki", kMission).value());
    for (std::uint32_t i = 0; i < kNames.size(); ++i) ASSERT_TRUE(pki_->add(BusRole::robot, kNames[i], i));
    ASSERT_TRUE(pki_->add(BusRole::robot, "lost", 9));
    ASSERT_TRUE(pki_->add(BusRole::worker, "w", {}));
    ASSERT_TRUE(pki_->add(BusRole::views, "vera", {}));
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] bus::BusCredentials credentials(const std::string& name) const {
    return bus::read_credentials(pki_->credential(name).string()).value();
  }
  void start_server() {
    server_.emplace([this](const std::atomic<bool>& stop) {
      program::ServerOptions options{.state = folder_ / "server",
                                     .pki = folder_ / "pki",
                                     .settings = lab::server_settings(source_).value(),
                                     .threads = 0,
                                     .rate = kRate};
      options.announce = [this](const std::string& command) {
        const std::size_t begin = command.find("tls://");
        url_ = command.substr(begin, command.find(' ', begin) - begin);
        announced_ = true;
      };
      return program::run_server(options, stop);
    });
    ASSERT_TRUE(within(kPatience_s, [&] { return announced_ || server_->over(); }));
    ASSERT_FALSE(server_->over()) << server_->ended().error().message;
  }
  void start_worker() {
    worker_.emplace([this](const std::atomic<bool>& stop) {
      program::WorkerOptions options{.bus = {.url = url_, .credentials = credentials("w")}};
      auto settings = lab::worker_settings(source_);
      if (!settings) return Status(tl::unexpected(settings.error()));
      options.settings = std::move(*settings);
      return program::run_worker(options, stop);
    });
  }
  void start_robot(const std::string& name) {
    robots_.push_back(std::make_unique<Running>([=, this](const std::atomic<bool>& stop) {
      program::RobotOptions options{.name = name,
                                    .bus = {.url = url_, .credentials = credentials(name)},
                                    .state = folder_ / name,
                                    .rate = kRate,
                                    .session = test::kSession};
      if (Status ok = lab::fill_robot_options(source_, options); !ok) return ok;
      return program::run_robot(options, stop);
    }));
  }
  [[nodiscard]] std::string log() const { return read_file((folder_ / "server/log.txt").string()).value_or(""); }
  [[nodiscard]] std::shared_ptr<bus::NatsConnection> connect(const std::string& name) const {
    auto connection =
        bus::NatsConnection::open({.url = url_, .mission = kMission, .credentials = credentials(name)}, "intruder");
    return connection ? std::move(*connection) : nullptr;
  }

  const lab::MissionSource source_ = test::mission_of(150, 10);
  fs::path folder_ = fs::path(::testing::TempDir()) / fmt::format("intruders_{}", getpid());
  std::optional<pki::Pki> pki_;
  std::string url_;
  std::atomic<bool> announced_ = false;
  std::optional<Running> server_, worker_;
  std::vector<std::unique_ptr<Running>> robots_;
};

/// Sends what a robot that was lost, a worker, a viewer and a second program with alpha's credential do, again and
/// again while the mission runs.
void intrude(const bus::NatsConnection& connection) {
  NodeStatus bravo{.name = "bravo", .version = "0"};
  bravo.session = test::kSession + 1;
  for (const auto& [subject, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"mission.small.robot.1.status", wire::encode(bravo)},
           {"mission.small.robot.0.status", wire::encode(bravo)},  // with alpha's credential: another's name
           {"mission.small.robot.1.submap", "forged"},
           {"$KV.GRAPH_small.robot.1.receipt", "forged"},
           {"$KV.GRAPH_small.robot.1.proxy_graph", "forged"},
           {"$KV.GRAPH_small.viewer.0.mission_status", "forged"},
           {"$KV.TUTTI_SERVERS.small", "forged"},
           {"mission.small.worker.7.verdicts", "forged"},
           {"mission.small.viewer.0.decision", "forged"},
           {"mission.small.operator.anna.decision", "forged"},
           {"mission.small.jobs.loop", "forged"},
           {"$JS.API.STREAM.DELETE.SUBMAPS_small", ""},
           {"$JS.API.STREAM.PURGE.KV_GRAPH_small", ""},
           {"$JS.API.CONSUMER.DELETE.SUBMAPS_small.server", ""},
           {"$JS.API.CONSUMER.DELETE.JOBS_small.workers", ""}})
    static_cast<void>(connection.publish(subject, "", "", bytes));
  connection.flush();
}

TEST_F(IntrudersSystem, AMissionWithRightsGivesTheSameMapWhateverIntrudersTry) {
  start_server();
  ASSERT_FALSE(HasFatalFailure());
  start_worker();
  std::vector<std::shared_ptr<bus::NatsConnection>> intruders;
  for (const char* name : {"lost", "w", "vera", "alpha"}) intruders.push_back(connect(name));
  ASSERT_TRUE(std::ranges::all_of(intruders, [](const auto& one) { return one != nullptr; }));
  for (const std::string& name : kNames) start_robot(name);
  const auto robots_end = [&] { return std::ranges::all_of(robots_, [](const auto& robot) { return robot->over(); }); };
  int rounds = 0;
  EXPECT_TRUE(within(kPatience_s, [&] {
    if (++rounds % 20 == 1)
      for (const auto& one : intruders) intrude(*one);
    return robots_end();
  }));
  for (const auto& robot : robots_) EXPECT_TRUE(robot->over() && robot->ended().has_value());
  ASSERT_TRUE(pki_->revoke("lost"));
  EXPECT_TRUE(within(10.0, [&] { return !intruders.front()->connected(); })) << "the server looks every second";
  EXPECT_TRUE(test::server_ends(folder_ / "server"));
  for (const char* expected :
       {"the bus refuses robot lost", "the bus refuses worker w", "the bus refuses viewer vera",
        "publish mission.small.robot.1.", "number 0 is robot 'alpha' by its credential, not 'bravo'"})
    EXPECT_TRUE(within(10.0, [&] { return log().find(expected) != std::string::npos; })) << expected;
  intruders.clear();
  robots_.clear();
  worker_.reset();
  server_.reset();
  test::expect_undisturbed_map(test::World(source_), folder_ / "server");
}

}  // namespace intruders_system_test
}  // namespace tutti
