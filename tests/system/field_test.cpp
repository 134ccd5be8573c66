// SPDX-License-Identifier: BSD-3-Clause
// The programs, in one process, where it is bad: a slow link that breaks at any byte and is away for ten minutes, a
// robot that joins late, disks that are full. Afterwards the map is that of nodes that talk to each other directly.
#include <gtest/gtest.h>
#include <nats/nats.h>
#include <sys/mount.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/bus/tcp_relay.hpp"
#include "support/paths.hpp"
#include "tutti/base/file.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/mission/robot_actor.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/program/robot_program.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/sqlite_store.hpp"

namespace tutti {
namespace field_test {

namespace fs = std::filesystem;
using test::TcpRelay;
using test::within;

constexpr std::uint64_t kSession = 1'700'000'000;
constexpr double kPatience_s = 120.0;  // a busy machine
const std::vector<std::string> kNames{"alpha", "bravo"};

/// Submaps of `submap_s`: few of them keep the map small, and the test fast.
lab::MissionSource mission_of(int duration_s, int submap_s) {
  lab::MissionSource source{.file = test::source_path("tests/system/small_mission.yaml").string()};
  source.assignments = {"server.update_period_s=50", fmt::format("agent.submap.duration_s={}", submap_s),
                        fmt::format("agent.submap.distance_m={}", submap_s)};
  for (const char* robot : {"0", "1"})
    source.assignments.push_back(fmt::format("simulation.robots.{}.walk.duration_s={}", robot, duration_s));
  return source;
}

/// A program on a thread.
class Running {
 public:
  template <class Run>
  explicit Running(Run run) : thread_([this, run] { ended_ = run(stop_), over_ = true; }) {}
  ~Running() {
    stop_ = true;
    thread_.join();
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  [[nodiscard]] bool over() const { return over_; }
  /// How it ended, once it is over.
  [[nodiscard]] const Status& ended() const { return ended_; }

 private:
  std::atomic<bool> stop_ = false, over_ = false;
  Status ended_;
  std::thread thread_;
};

using Rows = std::map<std::string, std::string>;
Rows rows_of(const storage::TableStore& map, const char* table) {
  Rows rows;
  EXPECT_TRUE(map.scan(table, {}, [&](std::string_view key, std::string_view bytes) {
    rows.emplace(key, bytes);
    return true;
  }));
  return rows;
}

struct World {
  explicit World(const lab::MissionSource& source) : config(lab::load(source).value()) {
    auto input = lab::load_input(config, {}, source.seed);
    EXPECT_TRUE(input.has_value());
    recordings = std::move(input->robots);
    finder = lab::make_finder(config, source).value();
  }
  [[nodiscard]] std::unique_ptr<node::ServerNode> open(const storage::TableStore& map) const {
    auto node = node::ServerNode::open({RobotId{0}, RobotId{1}}, finder, {.server = config.server}, 1, map);
    EXPECT_TRUE(node.has_value()) << node.error().message;
    return std::move(*node);
  }
  lab::MissionConfig config;
  std::vector<mission::MissionRecording> recordings;
  std::shared_ptr<const server::ClosureFinder> finder;
};

/// All submaps, one after the other, and every job done at once.
std::unique_ptr<storage::MemoryStore> undisturbed(const World& world) {
  auto map = std::make_unique<storage::MemoryStore>(storage::map_schema());
  const auto server = world.open(*map);
  node::WorkerNode worker(bus::Endpoint::worker(0), world.finder, node::SubmapFrames::of(*map));
  const auto serve = [&](const auto& self, const node::Step& step) -> void {
    EXPECT_TRUE(map->commit(step.writes));
    for (const bus::Envelope& message : step.messages)
      if (message.kind == bus::MessageKind::job)
        for (const bus::Envelope& answer : worker.receive(message, {}).messages)
          self(self, server->receive(answer, {}));
  };
  for (const mission::MissionRecording& recording : world.recordings) {
    storage::MemoryStore store(storage::robot_schema());
    node::RobotNodeConfig config{.agent = world.config.agent};
    config.uplink.max_under_way_bytes = 0;
    auto robot =
        std::move(mission::RobotActor::open(recording, config, world.config.association, kSession, store).value());
    robot->resume({});
    while (robot->next_time() < 1e9) {
      robot->replay_next({});
      const node::Step step = robot->take_step();
      EXPECT_TRUE(store.commit(step.writes));
      for (const bus::Envelope& message : step.messages) serve(serve, server->receive(message, {}));
    }
  }
  return map;
}

class Field : public ::testing::Test {
 protected:
  void SetUp() override {
    TUTTI_SKIP_WITHOUT_NATS_SERVER();
    folder_ = fs::path(::testing::TempDir()) / fmt::format("field_{}", getpid());
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  void start_server(const lab::MissionSource& source, double rate) {
    server_.emplace([this, source, rate](const std::atomic<bool>& stop) {
      program::ServerOptions options{
          .state = folder_ / "server", .settings = lab::server_settings(source).value(), .rate = rate};
      options.announce = [this](const std::string& command) {
        const std::string url = command.substr(command.find("nats://"));
        bus_port_ = std::atoi(url.substr(url.rfind(':') + 1).c_str());
      };
      return program::run_server(options, stop);
    });
    ASSERT_TRUE(within(kPatience_s, [&] { return bus_port_ > 0 || server_->over(); }));
    ASSERT_FALSE(server_->over()) << server_->ended().error().message;
  }
  void start_robot(const lab::MissionSource& source, double rate, const std::string& name, int port) {
    robots_.push_back(std::make_unique<Running>([=, this](const std::atomic<bool>& stop) {
      program::RobotOptions options{.name = name,
                                    .bus = {.url = fmt::format("nats://127.0.0.1:{}", port)},
                                    .state = folder_ / name,
                                    .rate = rate,
                                    .session = kSession};
      if (Status told = lab::tell_robot(source, options); !told) return told;
      return program::run_robot(options, stop);
    }));
  }
  [[nodiscard]] bool robots_end(double seconds) const {
    return within(seconds, [&] { return std::ranges::all_of(robots_, [](const auto& r) { return r->over(); }); });
  }
  [[nodiscard]] fs::path status_file() const { return folder_ / "server" / program::kStatusFile; }
  /// The map's status, as the server tells it; empty: it cannot be read.
  [[nodiscard]] std::string server_status() const { return read_file(status_file().string()).value_or(""); }
  /// By a status that is written after this is asked: the one before may not know the last submaps yet.
  [[nodiscard]] bool server_ends() const {
    const auto asked = fs::file_time_type::clock::now() + std::chrono::milliseconds(100);
    return within(kPatience_s, [&] {
      std::error_code replaced;
      const auto written = fs::last_write_time(status_file(), replaced);
      return !replaced && written > asked && server_status().find("\"pending_jobs\":0") != std::string::npos;
    });
  }
  /// When the server has ended.
  void expect_undisturbed_map(const World& world) {
    const auto expected = undisturbed(world);
    const auto opened = storage::open_sqlite_store(folder_ / "server" / program::kMapFile, storage::map_schema(),
                                                   {.min_free_bytes = 0});
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    const Rows submaps = rows_of(*expected, "submaps");
    EXPECT_GT(submaps.size(), 5U);
    EXPECT_TRUE(rows_of(**opened, "submaps") == submaps);  // which are long
    const auto a = world.open(**opened), b = world.open(*expected);
    EXPECT_EQ(a->map_server().state().verdicts, b->map_server().state().verdicts);
    const Timestamp later = Timestamp{} + 1e6;
    EXPECT_TRUE(std::ranges::none_of(a->resume(later).messages, [](const auto& message) {
      return message.kind == bus::MessageKind::job;
    })) << "a pair has no answer";
    static_cast<void>(b->resume(later)), static_cast<void>(a->on_timer(later + 1e3)), b->on_timer(later + 1e3);
    const auto &nodes = a->map_server().map().nodes, &others = b->map_server().map().nodes;
    ASSERT_EQ(nodes.size(), others.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) ASSERT_EQ(nodes[i].T_world_body, others[i].T_world_body) << i;
  }

  fs::path folder_;
  std::atomic<int> bus_port_ = 0;
  std::optional<Running> server_;
  std::vector<std::unique_ptr<Running>> robots_;
};

/// A hundred times faster than real time 200 ms are 20 s of the mission and 8 Mbit/s are 80 kbit/s; torn at random
/// bytes; ten minutes of the mission without a link; the second robot joins after these.
TEST_F(Field, AfterTenMinutesOutOfRangeOnABadLinkNothingIsLost) {
  constexpr double kRate = 100.0;
  const auto source = mission_of(720, 30);
  start_server(source, kRate);
  ASSERT_FALSE(HasFatalFailure());
  TcpRelay relay(bus_port_, {.delay_s = 0.2, .bytes_per_s = 1e6, .bytes_between_cuts = 300'000});
  start_robot(source, kRate, kNames[0], relay.port());
  within(1.0, [] { return false; });
  relay.hold(true);
  within(600.0 / kRate, [] { return false; });
  relay.hold(false);
  start_robot(source, 2.0 * kRate, kNames[1], relay.port());
  EXPECT_TRUE(robots_end(kPatience_s)) << server_status();
  for (const auto& robot : robots_) EXPECT_TRUE(robot->over() && robot->ended().has_value());
  RecordProperty("cuts", static_cast<int>(relay.cuts()));
  EXPECT_GE(relay.cuts(), 1U);
  EXPECT_TRUE(server_ends()) << server_status();
  robots_.clear();
  server_.reset();
  expect_undisturbed_map(World(source));
}

/// A disk of memory, for root.
class SmallDisk {
 public:
  explicit SmallDisk(fs::path folder) : folder_(std::move(folder)) {
    mounted_ = mount("tutti_test", folder_.c_str(), "tmpfs", 0, "size=6g") == 0;  // which takes nothing yet
  }
  ~SmallDisk() {
    if (mounted_) umount2(folder_.c_str(), MNT_DETACH);
  }
  SmallDisk(const SmallDisk&) = delete;
  SmallDisk& operator=(const SmallDisk&) = delete;
  [[nodiscard]] bool mounted() const { return mounted_; }
  /// To the last byte, or not any more.
  [[nodiscard]] bool fill(bool full) const {
    struct statvfs disk {};
    if (statvfs(folder_.c_str(), &disk) != 0) return false;
    const std::uint64_t used = std::uint64_t{disk.f_blocks - disk.f_bfree} * disk.f_frsize;
    const std::string size = full ? fmt::format("size={}", used) : "size=6g";
    return mount("tutti_test", folder_.c_str(), "tmpfs", MS_REMOUNT, size.c_str()) == 0;
  }

 private:
  fs::path folder_;
  bool mounted_ = false;
};

TEST_F(Field, OnFullDisksEverythingWaitsAndGoesOnWhenThereIsRoom) {
  constexpr double kRate = 25.0;
  const SmallDisk disk(folder_);
  if (!disk.mounted()) GTEST_SKIP() << "only root can make a small disk: nothing was tried";
  const auto source = mission_of(150, 10);
  start_server(source, kRate);
  ASSERT_FALSE(HasFatalFailure());
  for (const std::string& name : kNames) start_robot(source, kRate, name, bus_port_);
  const auto bus_runs = [&] {
    natsConnection* connection = nullptr;
    const bool runs =
        natsConnection_ConnectTo(&connection, fmt::format("nats://127.0.0.1:{}", bus_port_.load()).c_str()) == NATS_OK;
    natsConnection_Destroy(connection);
    return runs;
  };
  EXPECT_TRUE(bus_runs());
  within(2.0, [] { return false; });
  bool filled = false;
  EXPECT_TRUE(within(kPatience_s, [&] { return filled = filled || disk.fill(true); }));  // somebody may write meanwhile
  EXPECT_TRUE(within(kPatience_s, [&] { return !bus_runs(); }));  // it hangs on a full disk: it was stopped
  within(2.0, [] { return false; });
  for (const auto& robot : robots_) EXPECT_FALSE(robot->over());
  EXPECT_FALSE(server_->over());
  EXPECT_TRUE(disk.fill(false));
  EXPECT_TRUE(within(kPatience_s, bus_runs));
  EXPECT_TRUE(robots_end(kPatience_s)) << server_status();
  for (const auto& robot : robots_) EXPECT_TRUE(robot->over() && robot->ended().has_value());
  EXPECT_TRUE(server_ends()) << server_status();
  robots_.clear();
  server_.reset();
  expect_undisturbed_map(World(source));
}

}  // namespace field_test
}  // namespace tutti
