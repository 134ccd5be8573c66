// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tutti/program/feed/robot_view.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::program::test {

/// A robot on a store in memory, whose steps are committed.
class NodeTarget final : public FeedTarget {
 public:
  explicit NodeTarget(RobotId robot = RobotId{1}, const robot::AgentConfig& config = {})
      : NodeTarget(robot, node::RobotNodeConfig{.agent = config}) {}
  NodeTarget(RobotId robot, const node::RobotNodeConfig& config)
      : store_(storage::robot_schema()),
        node_(node::RobotNode::open(robot, 7, config, store_).value()),
        view_("alpha") {
    carry_out(node_->resume({}));
  }
  Status add(Input input) override {
    if (std::holds_alternative<OdometrySample>(input)) ended_ = false;
    return carry_out(node_->add(input, {}));
  }
  Status begin_session(const std::string& why) { return carry_out(node_->begin_session(why, {})); }
  Status finish() override {
    ended_ = true;
    return carry_out(node_->finish({}));
  }
  [[nodiscard]] FeedState state() const override {
    FeedState state = view_.state(*node_);
    state.ended = ended_;
    return state;
  }

  void receive(const bus::Envelope& envelope) { static_cast<void>(carry_out(node_->receive(envelope, {}))); }
  [[nodiscard]] const node::RobotNode& node() const { return *node_; }
  /// Sent since the last call.
  std::vector<bus::Envelope> take_sent() { return std::exchange(sent_, {}); }

 private:
  Status carry_out(const node::Step& step) {
    if (auto ok = store_.commit(step.writes); !ok) return ok;
    for (const node::Event& event : step.events) view_.note(event, *node_);
    sent_.insert(sent_.end(), step.messages.begin(), step.messages.end());
    return taken(step);
  }
  storage::MemoryStore store_;
  std::unique_ptr<node::RobotNode> node_;
  RobotView view_;
  std::vector<bus::Envelope> sent_;
  bool ended_ = false;
};

}  // namespace tutti::program::test
