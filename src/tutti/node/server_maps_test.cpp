// SPDX-License-Identifier: BSD-3-Clause
// A server takes messages while it makes a map. The map is made when the test asks: no clock and no thread decides.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "support/node/stored_server.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/storage/memory_store.hpp"

namespace tutti::node {
namespace server_maps_test {

using bus::MessageKind;
const ChainId kAlpha{RobotId{0}, 7}, kBravo{RobotId{1}, 7};

class MapBeingMade : public test::StoredServer {
 protected:
  MapBeingMade() {
    start({RobotId{0}, RobotId{1}}, {});
    for (std::uint32_t i = 0; i < 4; ++i) take_both(i);
    now_ = node_->next_timer().value();
    done(node_->tend(now_));
    task_ = node_->begin_map(now_);
  }
  /// A submap of each robot, and what workers find about it.
  void take_both(std::uint32_t index) {
    WorkerNode worker(bus::Endpoint::worker(0), verifier_, SubmapFrames::of(*store_));
    for (const ChainId& chain : {kAlpha, kBravo})
      for (const auto& job : of_kind(receive(test::submap(chain, index)), MessageKind::job))
        for (const auto& verdicts : worker.receive(job, now_).messages) receive(verdicts);
  }
  [[nodiscard]] std::size_t submaps_in_map() const {
    std::set<SubmapId> in;  // a submap is in the map if its second keyframe is
    for (const auto& [id, submap] : node_->map_server().state().submaps)
      if (server::find_node(node_->map_server().map(), {id.chain, submap->keyframes[1].index}) != nullptr)
        in.insert(id);
    return in.size();
  }
  static std::vector<std::size_t> updates(const Step& step) {
    std::vector<std::size_t> out;
    for (const Event& event : step.events)
      if (const auto* reported = std::get_if<MapUpdated>(&event.what)) out.push_back(reported->submaps);
    return out;
  }

  std::optional<MapTask> task_;
};

TEST_F(MapBeingMade, SubmapsAreStoredAndAcknowledgedBeforeItIsThere) {
  ASSERT_TRUE(task_.has_value());
  EXPECT_TRUE(node_->is_making_map());
  const Step step = receive(test::submap(kAlpha, 4));
  EXPECT_EQ(store_->tables().at("submaps").size(), 9U);
  const auto receipts = of_kind(step, MessageKind::receipt);
  ASSERT_EQ(receipts.size(), 1U);
  EXPECT_TRUE(wire::decode_receipt(*receipts[0].bytes)->contains({kAlpha, 4}));
  EXPECT_EQ(of_kind(step, MessageKind::job).size(), 1U);
  EXPECT_EQ(submaps_in_map(), 0U);

  const Step end = done(node_->end_map(make_map(std::move(*task_)), now_));
  EXPECT_EQ(updates(end), std::vector<std::size_t>{8});
  EXPECT_EQ(of_kind(end, MessageKind::proxy_graph).size(), 2U);
  EXPECT_EQ(submaps_in_map(), 8U);
  EXPECT_TRUE(node_->map_server().has_news());
}

TEST_F(MapBeingMade, WhatComesMeanwhileIsInTheNextWhichIsOneOfTheWholeSet) {
  take_both(4);
  now_ = now_ + 25.0;                                // it takes long
  EXPECT_FALSE(node_->begin_map(now_).has_value());  // one at a time
  EXPECT_EQ(node_->next_timer(), std::nullopt);      // and nobody is to ask
  done(node_->end_map(make_map(std::move(*task_)), now_));
  ASSERT_TRUE(node_->next_timer().has_value());
  now_ = *node_->next_timer();
  EXPECT_EQ(updates(done(node_->on_timer(now_))), std::vector<std::size_t>{10});
  EXPECT_FALSE(node_->map_server().has_news());
  const server::MapEstimate interleaved = node_->map_server().map();

  store_.reset();
  start({RobotId{0}, RobotId{1}}, {});
  for (std::uint32_t i = 0; i < 5; ++i) take_both(i);
  done(node_->on_timer(node_->next_timer().value()));
  const server::MapEstimate& at_once = node_->map_server().map();
  ASSERT_EQ(interleaved.nodes.size(), at_once.nodes.size());
  for (std::size_t i = 0; i < at_once.nodes.size(); ++i) {
    EXPECT_EQ(interleaved.nodes[i].id, at_once.nodes[i].id);
    EXPECT_EQ(interleaved.nodes[i].T_world_body, at_once.nodes[i].T_world_body);
  }
}

TEST_F(MapBeingMade, AServerThatIsKilledMeanwhileMakesItAgain) {
  take_both(4);
  const auto reported = read_map_meta(*store_).value();
  EXPECT_TRUE(reported->news);
  EXPECT_EQ(reported->revision, 0U);
  start({RobotId{0}, RobotId{1}}, {});
  EXPECT_EQ(updates(done(node_->on_timer(node_->next_timer().value()))), std::vector<std::size_t>{10});
  EXPECT_EQ(node_->map_server().state().revision, 1U);
}

TEST_F(MapBeingMade, TellsRobotsNamesThatHaveBeenReported) {
  const auto names = [&] {
    std::vector<std::string> out;
    for (const LastSeen& seen : node_->broadcast().last_seen) out.push_back(seen.name);
    return out;
  };
  done(node_->end_map(make_map(std::move(*task_)), now_));
  EXPECT_EQ(names(), (std::vector<std::string>{"", ""}));
  receive(to_server(bus::Endpoint::of(kBravo.robot), {.name = "bravo", .session = 7, .start = 1}));
  take_both(4);
  now_ = *node_->next_timer();
  done(node_->on_timer(now_));
  EXPECT_EQ(names(), (std::vector<std::string>{"", "bravo"}));
}

TEST_F(MapBeingMade, HasNewsUntilItIsThere) {
  EXPECT_TRUE(node_->mission_status(now_).has_news);
  done(node_->end_map(make_map(std::move(*task_)), now_));
  EXPECT_FALSE(node_->mission_status(now_).has_news);
  EXPECT_FALSE(read_map_meta(*store_).value()->news);
}

TEST_F(MapBeingMade, WhatItCostKeepsTheNextBack) {
  MapOfTask made = make_map(std::move(*task_));
  EXPECT_GT(made.pace.cost_s, 0.0);  // counted
  made.pace.cost_s = 20.0;           // measured by the host
  const Timestamp begun = now_;
  now_ = now_ + 21.0;
  done(node_->end_map(std::move(made), now_));
  take_both(4);
  EXPECT_EQ(node_->next_timer(), begun + 80.0);
  receive(test::envelope(ClosureDecision{"0/0-1/2", Wish::reject, "ada", 5}));
  EXPECT_EQ(node_->next_timer(), now_);  // an operator does not wait
  EXPECT_EQ(updates(done(node_->on_timer(now_))), std::vector<std::size_t>{10});
  now_ = now_ + 0.1;
  take_both(5);
  EXPECT_EQ(*node_->next_timer(), now_ + 0.4);  // what it has cost is counted again, and is little
}

TEST_F(MapBeingMade, AServerThatStartsAgainKeepsItsDistance) {
  MapOfTask made = make_map(std::move(*task_));
  made.pace.cost_s = 20.0;
  const Timestamp begun = now_;
  done(node_->end_map(std::move(made), now_));
  now_ = now_ + 30.0;
  start({RobotId{0}, RobotId{1}}, {});  // and makes the map that was there, which is no update
  ASSERT_TRUE(node_->has_map());
  take_both(4);
  EXPECT_EQ(node_->next_timer(), begun + 80.0);
  for (const double cost_s : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    ASSERT_TRUE(store_->commit(std::vector{to_row(LastUpdate{begun, cost_s})}).has_value());
    EXPECT_FALSE(read_last_update(*store_).value().has_value());
  }
  ASSERT_TRUE(store_->commit(std::vector{to_row(LastUpdate{begun, 1e300})}).has_value());
  EXPECT_EQ(read_last_update(*store_).value()->cost_s, 3600.0);
}

TEST_F(MapBeingMade, ARobotThatJoinsMeanwhileHearsOfTheNext) {
  done(node_->end_map(make_map(std::move(*task_)), now_));
  start({}, {.accepts_others = true});
  take_both(4);
  now_ = node_->next_timer().value();
  auto task = node_->begin_map(now_);
  const ChainId charlie{RobotId{2}, 7};
  receive(test::submap(charlie, 0));
  const auto to_charlie = [&](const Step& step) {
    return std::ranges::count(step.messages, bus::Endpoint::of(charlie.robot), &bus::Envelope::to);
  };
  EXPECT_EQ(to_charlie(done(node_->end_map(make_map(std::move(*task)), now_))), 0);
  now_ = node_->next_timer().value();
  EXPECT_EQ(to_charlie(done(node_->on_timer(now_))), 1);
}

}  // namespace server_maps_test
}  // namespace tutti::node
