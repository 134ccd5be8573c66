// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "support/bus/nats_network.hpp"
#include "support/paths.hpp"
#include "tutti/base/file.hpp"
#include "tutti/drive/replay.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/mission_source.hpp"
#include "tutti/mission/runner.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/storage/sqlite_store.hpp"

/// The mission of tests/system/small_mission.yaml, programs on threads, and the map that it is to give.
namespace tutti::test {

inline constexpr std::uint64_t kSession = 1'700'000'000;
inline constexpr double kPatience_s = 120.0;  // a busy machine
inline const std::vector<std::string> kNames{"alpha", "bravo"};

/// Submaps of `submap_s`: few of them keep the map small, and the test fast.
inline lab::MissionSource mission_of(int duration_s, int submap_s) {
  lab::MissionSource source{.file = source_path("tests/system/small_mission.yaml").string()};
  source.assignments = {"server.update_least_s=50", fmt::format("agent.submap.duration_s={}", submap_s),
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
inline Rows rows_of(const storage::TableStore& map, const char* table) {
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
    verifier = lab::make_verifier(config, source).value();
  }
  [[nodiscard]] std::unique_ptr<node::ServerNode> open(const storage::TableStore& map) const {
    auto node = node::ServerNode::open({RobotId{0}, RobotId{1}}, verifier, {.server = config.server}, 1, map);
    EXPECT_TRUE(node.has_value()) << node.error().message;
    return std::move(*node);
  }
  lab::MissionConfig config;
  std::vector<mission::MissionRecording> recordings;
  std::shared_ptr<const server::ClosureVerifier> verifier;
};

/// All submaps, one after the other, and every job done at once.
inline std::unique_ptr<storage::MemoryStore> undisturbed(const World& world) {
  auto map = std::make_unique<storage::MemoryStore>(storage::map_schema());
  const auto server = world.open(*map);
  node::WorkerNode worker(bus::Endpoint::worker(0), world.verifier, node::SubmapFrames::of(*map));
  const auto serve = [&](const auto& self, const node::Step& step) -> void {
    EXPECT_TRUE(map->commit(step.writes));
    for (const bus::Envelope& message : step.messages)
      if (message.kind == bus::MessageKind::job)
        for (const bus::Envelope& answer : worker.receive(message, {}).messages)
          self(self, server->receive(answer, {}));
  };
  for (const mission::MissionRecording& recording : world.recordings) {
    storage::MemoryStore store(storage::robot_schema());
    node::RobotNodeConfig config{.agent = drive::with_sensors(world.config.agent, recording.recording)};
    config.uplink.max_under_way_bytes = 0;
    drive::Driver robot(node::RobotNode::open(recording.recording.robot, kSession, config, store).value());
    drive::Replay replay(recording.recording, recording.start_s, robot);
    replay.resume({});
    while (replay.next_time() < 1e9) {
      replay.feed_next({});
      const node::Step step = robot.take_step();
      EXPECT_TRUE(store.commit(step.writes));
      for (const bus::Envelope& message : step.messages) serve(serve, server->receive(message, {}));
    }
  }
  return map;
}

/// Whether the server in this state folder soon has no job any more, by a status that is written after this is asked:
/// the one before may not know the last submaps yet.
inline bool server_ends(const std::filesystem::path& server) {
  const std::filesystem::path file = server / program::kStatusFile;
  const auto asked = std::filesystem::file_time_type::clock::now() + std::chrono::milliseconds(100);
  return within(kPatience_s, [&] {
    std::error_code replaced;
    const auto written = std::filesystem::last_write_time(file, replaced);
    return !replaced && written > asked &&
           read_file(file.string()).value_or("").find("\"pending_jobs\":0") != std::string::npos;
  });
}

/// In the state folder of a server that has ended: the map of nodes that talk to each other directly.
inline void expect_undisturbed_map(const World& world, const std::filesystem::path& server) {
  const auto expected = undisturbed(world);
  const auto opened =
      storage::open_sqlite_store(server / program::kMapFile, storage::map_schema(), {.min_free_bytes = 0});
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

}  // namespace tutti::test
