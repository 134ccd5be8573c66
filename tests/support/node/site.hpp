// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/node/submaps.hpp"
#include "support/robot/drifting_robot.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/frame.hpp"

namespace tutti::node::test {

/// The frame as the next version of its kind would be numbered.
inline std::string raised(std::string frame) {
  ++frame[2];
  return frame;
}

/// The frame as the program that wrote it would read it: the next version's are numbered as ours.
inline std::string lowered(std::string frame) {
  const auto kind = static_cast<wire::MessageKind>(frame.at(4));
  if (frame.at(2) == static_cast<char>(wire::versions(kind).current + 1)) --frame[2];
  return frame;
}

/// A robot that walks, a map server, and between them a bus that remembers every id that it has had, as NATS does for a
/// day, and the last value of each kind. Both programs start again at will, from what is on their disks; either may be
/// of the next version, which numbers its submaps one higher and reads ours too.
class Site {
 public:
  explicit Site(double least_s = 10.0) : least_s_(least_s) {
    start_server();
    start_robot();
  }

  void start_server() {
    auto tables = server_store_ ? server_store_->tables() : storage::MemoryStore::Tables{};
    for (auto& [key, frame] : tables["submaps"]) frame = server_is_newer_ ? lowered(frame) : frame;
    server_store_ = std::make_unique<storage::MemoryStore>(storage::map_schema(), std::move(tables));
    ServerNodeConfig config{.accepts_others = true};
    config.incarnation = 0x1000 + ++starts_;
    config.server.update_least_s = least_s_;
    auto opened = ServerNode::open({}, std::make_shared<EvenVerifier>(), config, epoch_, *server_store_);
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    server_ = std::move(*opened);
    server_does(server_->resume(now_));
    settle();
  }
  void start_robot() {
    robot_store_ = std::make_unique<storage::MemoryStore>(
        storage::robot_schema(), robot_store_ ? robot_store_->tables() : storage::MemoryStore::Tables{});
    auto opened = RobotNode::open(kRobot, 77, robot_config_, *robot_store_);
    ASSERT_TRUE(opened.has_value()) << opened.error().message;
    robot_ = std::move(*opened);
    robot_does(robot_->resume(now_));
    for (const auto& [kind, bytes] : std::map(retained_)) robot_hears(kind, bytes);
    settle();
  }
  void upgrade_server(bool newer) {
    // The next version has stored its submaps as its own.
    if (server_is_newer_ && !newer) server_store_ = with_submaps(raise_stored());
    server_is_newer_ = newer;
    start_server();
  }
  void upgrade_robot(bool newer) {
    robot_is_newer_ = newer;
    start_robot();
  }

  /// So many samples, a submap in about twenty; the robot reports how it is, and the map is updated.
  void walk(int samples) {
    for (const int end = walked_ + samples; walked_ < end; ++walked_) {
      pass(0.5);
      robot_does(robot_->add(
          OdometrySample{odometry_[walked_].stamp, odometry_[walked_].pose, robot::test::kStepCovariance}, now_));
      settle();
    }
    say();
  }
  void say() {
    NodeStatus status = robot_->status(now_);
    status.version = "0";
    server_does(server_->receive(to_server(bus::Endpoint::of(kRobot), std::move(status)), now_));
    settle();
  }
  /// With all that is due.
  void pass(double seconds) {
    now_ = now_ + seconds;
    if (const auto due = robot_->next_timer(); due && *due <= now_) robot_does(robot_->on_timer(now_));
    if (const auto due = server_->next_timer(); due && *due <= now_) server_does(server_->on_timer(now_));
    settle();
  }

  [[nodiscard]] storage::MemoryStore::Tables map() const { return server_store_->tables(); }
  /// Another map lies in its place; the server starts on it.
  void put_back(storage::MemoryStore::Tables map) {
    server_store_ = std::make_unique<storage::MemoryStore>(storage::map_schema(), std::move(map));
    start_server();
    say();
  }
  /// Somebody else's.
  void deliver(const bus::Envelope& message) {
    server_does(server_->receive(message, now_));
    settle();
  }
  void set_epoch(std::uint64_t epoch) { epoch_ = epoch; }
  void keep(std::uint64_t archive_bytes) {
    robot_config_.max_archive_bytes = archive_bytes;
    start_robot();
  }

  [[nodiscard]] ServerNode& server() { return *server_; }
  [[nodiscard]] RobotNode& robot() { return *robot_; }
  /// Submaps that the robot has ended.
  [[nodiscard]] std::size_t made() const { return made_.size(); }
  [[nodiscard]] std::size_t in_map() const { return server_->map_server().state().submaps.size(); }
  [[nodiscard]] std::size_t rows(const char* table) const { return robot_store_->tables().at(table).size(); }
  /// Messages of submaps that have come to the bus, and those that it has had before among them.
  [[nodiscard]] std::size_t sent() const { return sent_; }
  [[nodiscard]] std::size_t swallowed() const { return swallowed_; }
  template <class What>
  [[nodiscard]] std::vector<What> events_of() const {
    std::vector<What> out;
    for (const Event& event : events_)
      if (const auto* what = std::get_if<What>(&event.what)) out.push_back(*what);
    return out;
  }
  [[nodiscard]] Timestamp now() const { return now_; }
  static constexpr RobotId kRobot{3};

 private:
  using Submaps = storage::MemoryStore::Rows;
  [[nodiscard]] Submaps raise_stored() const {
    Submaps out = server_store_->tables().at("submaps");
    for (auto& [key, frame] : out)
      if (newer_.contains(key)) frame = raised(lowered(frame));
    return out;
  }
  [[nodiscard]] std::unique_ptr<storage::MemoryStore> with_submaps(Submaps submaps) const {
    auto tables = server_store_->tables();
    tables["submaps"] = std::move(submaps);
    return std::make_unique<storage::MemoryStore>(storage::map_schema(), std::move(tables));
  }

  void robot_does(const Step& step) {
    ASSERT_TRUE(robot_store_->commit(step.writes).has_value());
    for (const storage::Write& write : step.writes)
      if (write.table == "outbox" && write.bytes && made_.insert(write.key).second && robot_is_newer_)
        newer_.insert(write.key);
    events_.insert(events_.end(), step.events.begin(), step.events.end());
    for (const bus::Envelope& message : step.messages) {
      ++sent_;
      if (!ids_.insert(message.id).second) {
        ++swallowed_;
        continue;
      }
      bus::Envelope& waiting = for_server_.emplace_back(message);
      if (newer_.contains(key_of(*submap_of(message.id))))
        waiting.bytes = std::make_shared<const std::string>(raised(*message.bytes));
    }
  }
  void server_does(const Step& step) {
    ASSERT_TRUE(server_store_->commit(step.writes).has_value());
    events_.insert(events_.end(), step.events.begin(), step.events.end());
    for (const bus::Envelope& message : step.messages)
      if (message.to == bus::Endpoint::of(kRobot)) {
        retained_[message.kind] = message.bytes;
        for_robot_.emplace_back(message.kind, message.bytes);
      }
  }
  void robot_hears(bus::MessageKind kind, const std::shared_ptr<const std::string>& bytes) {
    robot_does(robot_->receive({bus::Endpoint::server(), bus::Endpoint::of(kRobot), kind, {}, bytes}, now_));
  }
  void settle() {
    while (robot_ && (!for_server_.empty() || !for_robot_.empty())) {
      if (!for_robot_.empty()) {
        const auto [kind, bytes] = for_robot_.front();
        for_robot_.pop_front();
        robot_hears(kind, bytes);
        continue;
      }
      bus::Envelope message = for_server_.front();
      for_server_.pop_front();
      if (server_is_newer_) message.bytes = std::make_shared<const std::string>(lowered(*message.bytes));
      server_does(server_->receive(message, now_));
    }
  }

  const Trajectory odometry_ = robot::test::drifting_odometry(500);
  double least_s_;
  std::uint64_t epoch_ = 1'700'000'000;
  RobotNodeConfig robot_config_;
  std::unique_ptr<storage::MemoryStore> server_store_, robot_store_;
  std::unique_ptr<ServerNode> server_;
  std::unique_ptr<RobotNode> robot_;
  bool server_is_newer_ = false, robot_is_newer_ = false;
  std::set<std::string> made_, newer_;  // keys of submaps, and of those that the next version has made
  std::set<std::string> ids_;
  std::deque<bus::Envelope> for_server_;
  std::deque<std::pair<bus::MessageKind, std::shared_ptr<const std::string>>> for_robot_;
  std::map<bus::MessageKind, std::shared_ptr<const std::string>> retained_;
  std::vector<Event> events_;
  std::size_t sent_ = 0, swallowed_ = 0;
  std::uint32_t starts_ = 0;
  int walked_ = 0;
  Timestamp now_;
};

}  // namespace tutti::node::test
