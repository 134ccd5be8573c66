// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_server.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "support/server/world.hpp"

namespace tutti::server {
namespace map_server_test {

using test::TestVerifier;

const std::set<RobotId> kRobots{RobotId{0}, RobotId{1}};

SubmapMessage message_of(const Submap& submap) {
  return {.header = {.robot = submap.id.chain.robot, .session = submap.id.chain.session}, .submap = submap};
}

void do_job(MapServer& server, const ClosureVerifier& verifier, const VerificationJob& job) {
  const auto verdict = verifier.verify(*job.first, *job.second, server.payloads());
  ASSERT_TRUE(verdict.has_value()) << verdict.error().message;
  ASSERT_TRUE(server.receive(*verdict).has_value());
}

void do_jobs(MapServer& server, const ClosureVerifier& verifier) {
  for (const VerificationJob& job : server.take_jobs()) do_job(server, verifier, job);
}

std::shared_ptr<PayloadStore> some_store() { return std::make_shared<MemoryPayloadStore>(); }

MapServer filled_server(const std::shared_ptr<const TestVerifier>& verifier) {
  MapServer server(kRobots, verifier, some_store(), {}, 1);
  for (const RobotId robot : kRobots)
    for (const Submap& submap : test::make_submaps(robot, {}, Rng(1).fork(robot.value)))
      EXPECT_TRUE(server.receive(message_of(submap)).has_value());
  return server;
}

TEST(MapServer, TurnsSubmapsIntoAProxyGraphOfTheRepresentativeNodes) {
  const auto verifier = std::make_shared<const TestVerifier>(1);
  MapServer server = filled_server(verifier);
  do_jobs(server, *verifier);
  EXPECT_TRUE(server.has_news());
  const ProxyGraphMessage message = server.optimise();
  EXPECT_FALSE(server.has_news());
  EXPECT_EQ(message.graph.revision, 1U);
  EXPECT_EQ(message.graph.nodes.size(), 2U * 46U);  // every second of 91 keyframes
  ASSERT_EQ(message.graph.components.size(), 2U);
  EXPECT_EQ(message.graph.components[0].component, message.graph.components[1].component);
}

TEST(MapServer, AsksForEachPairOnceAndIgnoresDuplicates) {
  const auto verifier = std::make_shared<const TestVerifier>(1);
  MapServer server = filled_server(verifier);
  EXPECT_GT(server.take_jobs().size(), 5U);
  for (const Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1).fork(0)))
    EXPECT_TRUE(server.receive(message_of(submap)).has_value());
  EXPECT_TRUE(server.take_jobs().empty());
  EXPECT_EQ(server.state().submaps.size(), 18U);
}

TEST(MapServer, HandsOutAJobThatWasGivenBackUntilItHasAVerdict) {
  const auto verifier = std::make_shared<const TestVerifier>(1);
  MapServer server = filled_server(verifier);
  const std::vector<VerificationJob> jobs = server.take_jobs();
  server.give_back(jobs[2]);  // its cloud could not be read
  const std::vector<VerificationJob> again = server.take_jobs();
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again.front().pair, jobs[2].pair);
  EXPECT_TRUE(server.receive(ClosureVerdict{jobs[2].pair, {}, Refusal{}, verifier->id()}));
  server.give_back(jobs[2]);
  EXPECT_TRUE(server.take_jobs().empty());
}

TEST(MapServer, RefusesStrangersAndMalformedSubmapsAndKeepsTheMap) {
  const auto verifier = std::make_shared<const TestVerifier>(1);
  MapServer server = filled_server(verifier);
  const std::size_t before = server.state().submaps.size();

  const auto refused = [&](Submap submap, ErrorCode code, const char* word) {
    SubmapMessage message = message_of(submap);
    const auto status = server.receive(message);
    ASSERT_FALSE(status.has_value());
    EXPECT_EQ(status.error().code, code);
    EXPECT_NE(status.error().message.find(word), std::string::npos) << status.error().message;
  };
  Submap good = test::make_submaps(RobotId{0}, {}, Rng(7)).front();
  good.id.index = 99;
  Submap stranger = good;
  stranger.id.chain = RobotId{7};
  refused(stranger, ErrorCode::unknown_robot, "robot 7");
  Submap nan = good;
  nan.keyframes[2].T_odom_body.translation.x() = std::numeric_limits<double>::quiet_NaN();
  refused(nan, ErrorCode::invalid, "keyframe 2");
  Submap backwards = good;
  backwards.keyframes[3].stamp = backwards.keyframes[2].stamp;
  refused(backwards, ErrorCode::invalid, "does not follow");
  Submap uneven = good;
  uneven.odometry.pop_back();
  refused(uneven, ErrorCode::invalid, "odometry factors");
  Submap diverged = good;
  diverged.odometry[4].T_a_b.translation.y() = 1e9;
  refused(diverged, ErrorCode::invalid, "to keyframe 5, expected at most 10000 m");
  Submap contradictory = good;
  contradictory.odometry[4].T_a_b.translation.y() += 0.5;
  refused(contradictory, ErrorCode::invalid, "odometry to keyframe 5 is 0.500 m and 0.000 rad from its poses");
  Submap indefinite = good;
  indefinite.odometry[4].covariance(0, 1) = indefinite.odometry[4].covariance(1, 0) = 1.0;
  refused(indefinite, ErrorCode::invalid, "odometry to keyframe 5: covariance is not positive semidefinite");
  Submap nothing{.id = {RobotId{0}, 98}};
  refused(nothing, ErrorCode::invalid, "0 keyframes");

  Submap restarted = test::make_submaps(RobotId{0}, {}, Rng(7)).front();  // other odometry, the same numbers
  refused(restarted, ErrorCode::invalid, "robot 0 has used session 0 before");

  SubmapMessage disguised = message_of(good);
  disguised.header.robot = RobotId{1};  // a robot may not write another's map
  EXPECT_FALSE(server.receive(disguised).has_value());
  EXPECT_EQ(server.state().submaps.size(), before);
}

TEST(MapServer, GoesOnFromASavedState) {
  const auto verifier = std::make_shared<const TestVerifier>(1, 5);
  MapServer whole = filled_server(verifier);
  std::vector<VerificationJob> jobs = whole.take_jobs();
  for (std::size_t i = 0; i < jobs.size() / 2; ++i) do_job(whole, *verifier, jobs[i]);
  whole.optimise();

  MapServer restored(kRobots, verifier, some_store(), {}, 2, whole.state());  // killed with half of the verdicts
  EXPECT_TRUE(restored.has_news());
  do_jobs(restored, *verifier);
  for (std::size_t i = jobs.size() / 2; i < jobs.size(); ++i) do_job(whole, *verifier, jobs[i]);
  ProxyGraphMessage a = whole.optimise();
  const ProxyGraphMessage b = restored.optimise();
  EXPECT_GT(b.graph.age(), a.graph.age());
  a.graph.epoch = b.graph.epoch;
  EXPECT_EQ(a.graph, b.graph);  // the same revision too
}

TEST(MapServer, EveryStartIsALaterEpochThanTheStateItGoesOnFrom) {
  const auto verifier = std::make_shared<const TestVerifier>(1);
  MapServer first(kRobots, verifier, some_store(), {}, 1'700);
  EXPECT_EQ(first.optimise().graph.age(), std::pair(std::uint64_t{1'700}, std::uint64_t{1}));
  const MapServerState saved = first.state();
  for (int i = 0; i < 20; ++i) first.optimise();  // lost
  const auto epoch_of_start = [&](std::uint64_t given) {
    MapServer again(kRobots, verifier, some_store(), {}, given, saved);
    const ProxyGraphMessage message = again.optimise();
    EXPECT_GT(message.graph.age(), first.optimise().graph.age());
    EXPECT_EQ(message.header.session, message.graph.epoch);
    return message.graph.epoch;
  };
  EXPECT_EQ(epoch_of_start(1'800), 1'800U);  // two starts from one state: the starter's number orders them
  EXPECT_EQ(epoch_of_start(1'900), 1'900U);
  EXPECT_EQ(epoch_of_start(3), 1'701U);  // a clock that went back
}

/// Robot 0 loses its state and walks the same way again, with the same stamps and the same numbers.
std::vector<Submap> second_session(std::uint64_t session) {
  return test::make_submaps({RobotId{0}, session}, {}, Rng(99));
}

TEST(MapServer, ARobotThatStartsAgainBeginsAChainOfItsOwnAndLosesNothing) {
  for (const std::uint64_t session : {std::uint64_t{1}, std::uint64_t{1'700'000'000'000'000'000}, ~std::uint64_t{0}}) {
    const auto verifier = std::make_shared<const TestVerifier>(1);
    MapServer server = filled_server(verifier);
    do_jobs(server, *verifier);
    server.optimise();
    const MapEstimate before = server.map();
    const std::vector<Submap> again = second_session(session);
    ASSERT_TRUE(server.receive(message_of(again.front())).has_value());
    server.optimise();  // no closure ties it to the map yet
    EXPECT_EQ(server.map().components, 2U);
    for (const MapNode& node : before.nodes) {
      const auto now = std::ranges::find(server.map().nodes, node.id, &MapNode::id);
      ASSERT_NE(now, server.map().nodes.end());
      EXPECT_LT(local(node.T_world_body, now->T_world_body).norm(), 1e-6);
    }
    for (int copies = 0; copies < 2; ++copies)
      for (const Submap& submap : again) ASSERT_TRUE(server.receive(message_of(submap)).has_value());
    do_jobs(server, *verifier);
    const ProxyGraph graph = server.optimise().graph;
    EXPECT_EQ(server.map().components, 1U);
    EXPECT_TRUE(server.map().left_out.empty());
    EXPECT_EQ(server.map().nodes.size(), 3U * 91U);
    ASSERT_EQ(graph.components.size(), 3U);
    EXPECT_EQ(graph.components[1].chain, (ChainId{RobotId{0}, session}));
    ASSERT_EQ(graph.uncertainties.size(), 2U);  // of the sessions that hear it
    EXPECT_EQ(graph.uncertainties[0].chain, (ChainId{RobotId{0}, session}));
    for (const ChainId& chain : {ChainId(RobotId{0}), ChainId{RobotId{0}, session}})
      EXPECT_EQ(std::ranges::count(graph.nodes, chain, &ProxyNode::chain), 46);
    for (const MapNode& node : server.map().nodes) {  // both sessions where they were
      const auto first = std::ranges::find(server.map().nodes, KeyframeId{RobotId{0}, 0}, &MapNode::id);
      const Pose3 T_world_true = first->T_world_body * test::true_pose(RobotId{0}, 0).inverse();
      const Pose3 truth = T_world_true * test::true_pose(node.id.chain.robot, node.id.index);
      EXPECT_LT((node.T_world_body.translation - truth.translation).norm(), 0.5);
    }
  }
}

TEST(MapServer, WithTwoSessionsTheMapIsAFunctionOfTheSet) {
  const auto verifier = std::make_shared<const TestVerifier>(1, 5);
  std::vector<Submap> submaps = second_session(7);
  for (const RobotId robot : kRobots)
    std::ranges::copy(test::make_submaps(robot, {}, Rng(1).fork(robot.value)), std::back_inserter(submaps));
  const auto map_of = [&] {
    MapServer server(kRobots, verifier, some_store(), {}, 1);
    for (const Submap& submap : submaps) EXPECT_TRUE(server.receive(message_of(submap)).has_value());
    std::vector<VerificationJob> jobs = server.take_jobs();
    if (submaps.front().id.index % 2 == 0) std::ranges::reverse(jobs);
    for (const VerificationJob& job : jobs) do_job(server, *verifier, job);
    return server.optimise().graph;
  };
  const ProxyGraph expected = map_of();
  Rng rng(3);
  for (int round = 0; round < 3; ++round) {
    for (std::size_t i = submaps.size(); i > 1; --i) std::swap(submaps[i - 1], submaps[rng.index(i)]);
    EXPECT_EQ(map_of(), expected);
  }
}

/// Verifies by looking at the clouds: as many points as the submap's number says, each at x = that number.
class CloudReader final : public ClosureVerifier {
 public:
  [[nodiscard]] MethodId id() const override { return {"clouds", 1, 0}; }
  [[nodiscard]] bool can_compare(const PayloadSize& first, const PayloadSize& second) const override {
    return first.points > 0 && second.points > 0;
  }
  [[nodiscard]] bool is_candidate(const Submap& first, const Submap& second) const override {
    return first.cloud == nullptr && second.cloud == nullptr;  // as promised
  }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap& first, const Submap& second,
                                              const PayloadStore& payloads) const override {
    double seen = 0.0;
    for (const SubmapId id : {first.id, second.id}) {
      const auto cloud = payloads.cloud(id);
      if (!cloud) return tl::unexpected(cloud.error());
      EXPECT_EQ((*cloud)->points.front().x(), static_cast<float>((*cloud)->points.size()));
      seen = 10.0 * seen + static_cast<double>((*cloud)->points.size());
    }
    return ClosureVerdict{{first.id, second.id}, {}, Refusal{RefusalReason::too_small, seen, 1000.0}, id()};
  }
};

/// Forgets what it is told to, and cannot keep what it is told not to.
class BrokenStore final : public PayloadStore {
 public:
  Status put(const Submap& submap) override {
    if (is_full) return fail(ErrorCode::io, "disk full");
    ++puts;
    lost.erase(submap.id);
    return inner_.put(submap);
  }
  [[nodiscard]] Result<std::shared_ptr<const PointCloud>> cloud(SubmapId id) const override {
    if (lost.contains(id)) return fail(ErrorCode::io, "cloud of submap {}/{} is lost", id.chain.robot.value, id.index);
    return inner_.cloud(id);
  }
  [[nodiscard]] Result<std::shared_ptr<const VisualPayload>> visual(SubmapId id) const override {
    return inner_.visual(id);
  }
  bool is_full = false;
  std::size_t puts = 0;
  std::set<SubmapId> lost;

 private:
  MemoryPayloadStore inner_;
};

/// Submaps of robot 0; the odd ones have clouds.
std::vector<SubmapMessage> submaps_with_some_clouds() {
  std::vector<SubmapMessage> messages;
  for (Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1))) {
    const std::uint32_t i = submap.id.index;
    submap.cloud = std::make_shared<PointCloud>();
    if (i % 2 == 1)
      submap.cloud = std::make_shared<PointCloud>(
          PointCloud{std::vector<Eigen::Vector3f>(i, Eigen::Vector3f::Constant(static_cast<float>(i)))});
    messages.push_back(message_of(submap));
  }
  return messages;
}

TEST(MapServer, KeepsCloudsInTheStoreOnlyAndHandsThemToTheVerifier) {
  const auto verifier = std::make_shared<const CloudReader>();
  const auto store = std::make_shared<BrokenStore>();
  MapServer server(kRobots, verifier, store, {}, 1);
  for (const SubmapMessage& message : submaps_with_some_clouds()) ASSERT_TRUE(server.receive(message).has_value());
  for (const auto& [id, submap] : server.state().submaps) EXPECT_EQ(submap->cloud, nullptr);
  EXPECT_EQ(server.state().payload_sizes.size(), 4U);  // of submaps 1, 3, 5, 7 of 0 ... 8
  EXPECT_EQ(server.state().payload_sizes.at({RobotId{0}, 5}).points, 5U);

  const auto jobs = server.take_jobs();
  EXPECT_EQ(jobs.size(), 4U * 3U / 2U);
  do_job(server, *verifier, jobs.back());
  EXPECT_EQ(server.refusals().at(RefusalReason::too_small).nearest.value, 57.0);

  // All but one were not answered: after a restart they are asked again, from the same store.
  MapServer restored(kRobots, verifier, store, {}, 2, server.state());
  EXPECT_EQ(restored.take_jobs().size(), 5U);
}

TEST(MapServer, ACloudThatIsLostOrCannotBeKeptCostsNothingElse) {
  const auto verifier = std::make_shared<const CloudReader>();
  const auto store = std::make_shared<BrokenStore>();
  MapServer server(kRobots, verifier, store, {}, 1);
  const auto messages = submaps_with_some_clouds();
  store->is_full = true;
  EXPECT_TRUE(server.receive(messages[0]).has_value());  // has none
  EXPECT_FALSE(server.receive(messages[1]).has_value());
  EXPECT_EQ(server.state().submaps.size(), 1U);
  store->is_full = false;
  for (const SubmapMessage& message : messages) EXPECT_TRUE(server.receive(message).has_value());
  store->lost = {{RobotId{0}, 3}};
  std::size_t failures = 0;
  for (const VerificationJob& job : server.take_jobs()) {
    const auto verdict = verifier->verify(*job.first, *job.second, server.payloads());
    failures += verdict ? 0 : 1;
    if (!verdict) continue;
    EXPECT_TRUE(server.receive(*verdict).has_value());
  }
  EXPECT_EQ(failures, 3U);
  EXPECT_EQ(server.refusals().at(RefusalReason::too_small).intra, 3U);
  EXPECT_GT(server.optimise().graph.nodes.size(), 10U);
}

TEST(MapServer, ASubmapThatComesAgainReplacesItsLostCloud) {
  const auto verifier = std::make_shared<const CloudReader>();
  const auto store = std::make_shared<BrokenStore>();
  MapServer server(kRobots, verifier, store, {}, 1);
  const auto messages = submaps_with_some_clouds();
  for (const SubmapMessage& message : messages) ASSERT_TRUE(server.receive(message).has_value());
  const std::size_t puts = store->puts;
  for (const SubmapMessage& message : messages) ASSERT_TRUE(server.receive(message).has_value());
  EXPECT_EQ(store->puts, puts);  // nothing is lost

  const SubmapId id = messages[3].submap.id;
  store->lost = {id};
  SubmapMessage other = messages[3];
  other.submap.cloud = messages[5].submap.cloud;  // not what was in the map
  EXPECT_TRUE(server.receive(other).has_value());
  other.submap.cloud = nullptr;
  EXPECT_TRUE(server.receive(other).has_value());
  other.submap = messages[5].submap;
  other.submap.id = id;
  EXPECT_FALSE(server.receive(other).has_value());
  EXPECT_FALSE(store->cloud(id).has_value());
  store->is_full = true;
  EXPECT_FALSE(server.receive(messages[3]).has_value());
  store->is_full = false;
  EXPECT_TRUE(server.receive(messages[3]).has_value());
  EXPECT_EQ(store->puts, puts + 1);
  ASSERT_TRUE(store->cloud(id).has_value());
  EXPECT_EQ((*store->cloud(id))->points, messages[3].submap.cloud->points);
  EXPECT_EQ(server.state().submaps.size(), messages.size());
}

TEST(MapServer, RefusesSessionsBeyondARobotsShare) {
  const auto verifier = std::make_shared<const CloudReader>();  // nothing to verify
  MapServer server(kRobots, verifier, some_store(), {}, 1);
  const Submap all = test::make_submaps(RobotId{0}, {}, Rng(1)).front();
  Submap one{.id = all.id, .keyframes = {all.keyframes.front()}};
  const std::size_t most = ProxyGraph::kMostChains / kRobots.size();
  for (std::uint64_t session = 0; session < most; ++session) {
    one.id.chain.session = 3 * session;
    ASSERT_TRUE(server.receive(message_of(one)).has_value()) << session;
  }
  one.id.chain.session = 1;
  const Status refused = server.receive(message_of(one));
  ASSERT_FALSE(refused.has_value());
  EXPECT_NE(refused.error().message.find(fmt::format("begins session 1, but has {} in the map", most)),
            std::string::npos)
      << refused.error().message;
  Submap others = test::make_submaps(RobotId{1}, {}, Rng(1)).front();
  EXPECT_TRUE(server.receive(message_of(others)).has_value());
  one.id.chain.session = 3;
  ++one.id.index;
  EXPECT_TRUE(server.receive(message_of(one)).has_value());
}

}  // namespace map_server_test
}  // namespace tutti::server
