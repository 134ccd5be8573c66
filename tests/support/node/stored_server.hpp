// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <memory>
#include <set>
#include <vector>

#include "support/node/submaps.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::node::test {

/// A server on a store in memory, whose steps are committed.
class StoredServer : public testing::Test {
 protected:
  /// From the bytes of its store, where there was one before. Returns what it does first; a map without news is
  /// computed.
  Step start(const std::set<RobotId>& robots, const ServerNodeConfig& config) {
    store_ = std::make_unique<storage::MemoryStore>(storage::map_schema(),
                                                    store_ ? store_->tables() : storage::MemoryStore::Tables{});
    node_ = ServerNode::open(robots, verifier_, config, 1000 + ++starts_, *store_).value();
    Step first = done(node_->resume(now_));
    if (node_->map_server().has_news() || node_->has_map() || node_->next_timer() != now_) return first;
    Step map = done(node_->on_timer(now_));
    std::ranges::move(map.messages, std::back_inserter(first.messages));
    std::ranges::move(map.events, std::back_inserter(first.events));
    return first;
  }
  Step done(Step step) {
    EXPECT_TRUE(store_->commit(step.writes).has_value());
    return step;
  }
  Step receive(const bus::Envelope& envelope) { return done(node_->receive(envelope, now_)); }
  Step receive(const SubmapMessage& message) { return receive(envelope(message)); }
  static std::vector<bus::Envelope> of_kind(const Step& step, bus::MessageKind kind) {
    std::vector<bus::Envelope> out;
    std::ranges::copy_if(step.messages, std::back_inserter(out), [&](const auto& m) { return m.kind == kind; });
    return out;
  }
  /// Waits, and returns what is sent of this kind until `later`.
  std::vector<bus::Envelope> wait_for(bus::MessageKind kind, double later) {
    std::vector<bus::Envelope> out;
    const Timestamp end = now_ + later;
    while (node_->next_timer() && *node_->next_timer() <= end) {
      now_ = *node_->next_timer();
      std::ranges::move(of_kind(done(node_->on_timer(now_)), kind), std::back_inserter(out));
    }
    now_ = end;
    return out;
  }

  std::shared_ptr<const server::ClosureVerifier> verifier_ = std::make_shared<EvenVerifier>();
  std::unique_ptr<storage::MemoryStore> store_;
  std::unique_ptr<ServerNode> node_;
  std::uint64_t starts_ = 0;
  Timestamp now_ = Timestamp{} + 3.0;
};

}  // namespace tutti::node::test
