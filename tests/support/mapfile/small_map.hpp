// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/server/world.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/wire/codec.hpp"

/// Maps made by a server node, with a worker beside it, of robots that walk in circles (support/server/world.hpp).
namespace tutti::mapfile::test {

/// True relative poses with evidence; every fourth is wrong. Sessions of one robot walk the same trajectory at other
/// times.
class ExplainingVerifier final : public server::WrappedVerifier {
 public:
  ExplainingVerifier() : WrappedVerifier(std::make_shared<server::test::TestVerifier>(7, 4)) {}
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const server::PayloadStore& payloads) const override {
    auto verdict = wrapped().verify(first, second, payloads);
    verdict->evidence = {{RefusalReason::overlap, 0.75, 0.3}};
    return verdict;
  }
  /// Finds what verify() does, not what the wrapped verifier would.
  [[nodiscard]] Result<Inspection> inspect(const Submap& first, const Submap& second,
                                           const server::PayloadStore& payloads,
                                           const std::optional<Pose3>& T_first_second) const override {
    return ClosureVerifier::inspect(first, second, payloads, T_first_second);
  }
};

/// A server on a store, everything that it asks for answered by a worker.
class Mapper {
 public:
  Mapper(std::set<RobotId> robots, storage::TableStore& store, std::uint64_t epoch = 1000)
      : Mapper(std::move(robots), store, std::make_shared<ExplainingVerifier>(), {}, epoch) {}
  Mapper(std::set<RobotId> robots, storage::TableStore& store, std::shared_ptr<const server::ClosureVerifier> verifier,
         const server::ServerConfig& config, std::uint64_t epoch = 1000)
      : store_(store), verifier_(std::move(verifier)) {
    auto opened = node::ServerNode::open(std::move(robots), verifier_, {.server = config}, epoch, store);
    EXPECT_TRUE(opened.has_value()) << opened.error().message;
    node_ = std::move(*opened);
    take(node_->resume(now_));
  }
  /// All submaps of a session, each with a cloud, by default of one point; then the map is updated.
  void walk(const ChainId& chain, std::uint64_t seed = 1,
            const std::function<PointCloud(const Submap&)>& cloud_of = one_point) {
    for (Submap& submap :
         server::test::make_submaps(chain, {}, Rng(seed).fork(chain.robot.value).fork(chain.session))) {
      submap.cloud = std::make_shared<const PointCloud>(cloud_of(submap));
      for (Keyframe& keyframe : submap.keyframes)
        keyframe.stamp.ns += static_cast<std::int64_t>(chain.session) * 1'000'000'000'000;
      const SubmapMessage message{{chain.robot, chain.session, submap.id.index}, std::move(submap)};
      take(node_->receive(
          {bus::Endpoint::of(chain.robot), bus::Endpoint::server(), bus::MessageKind::submap,
           node::message_id(message.submap.id), std::make_shared<const std::string>(wire::encode(message))},
          now_));
    }
    update();
  }
  static PointCloud one_point(const Submap& submap) {
    return {{{1.0F, 2.0F, 0.5F * static_cast<float>(submap.id.index)}}};
  }
  void update() {
    now_ = now_ + 100.0;
    take(node_->on_timer(now_));
  }
  [[nodiscard]] const server::MapServer& server() const { return node_->map_server(); }
  [[nodiscard]] const node::ServerNode& node() const { return *node_; }

 private:
  void take(node::Step step) {
    EXPECT_TRUE(store_.commit(step.writes).has_value());
    for (const node::Event& event : step.events)
      if (const auto* refused = std::get_if<node::MessageRefused>(&event.what)) ADD_FAILURE() << refused->why;
    node::WorkerNode worker(bus::Endpoint::worker(2), verifier_, node::SubmapFrames::of(store_));
    for (const bus::Envelope& message : step.messages)
      if (message.kind == bus::MessageKind::job)
        for (const bus::Envelope& answer : worker.receive(message, now_).messages) take(node_->receive(answer, now_));
  }

  storage::TableStore& store_;
  std::shared_ptr<const server::ClosureVerifier> verifier_;
  std::unique_ptr<node::ServerNode> node_;
  Timestamp now_;
};

/// Rows of table `meta` whose keys begin so.
inline std::size_t rows_of(const storage::TableStore& map, std::string_view prefix) {
  std::size_t rows = 0;
  EXPECT_TRUE(node::each_row_of(map, prefix, [&](std::string_view, std::string_view) {
    ++rows;
    return Status();
  }));
  return rows;
}

}  // namespace tutti::mapfile::test
