// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/refinements.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "support/server/refiners.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {
namespace refinements_test {

/// The true steps of every chain, known to a millimetre.
std::vector<RefinedStep> true_steps(const MapEstimate& map) {
  std::vector<RefinedStep> out;
  for (std::size_t i = 0; i + 1 < map.nodes.size(); ++i) {
    const KeyframeId a = map.nodes[i].id, b = map.nodes[i + 1].id;
    if (a.chain != b.chain) continue;
    const Pose3 step = test::true_pose(a.chain.robot, a.index).inverse() * test::true_pose(b.chain.robot, b.index);
    out.push_back({a, {step, diagonal_covariance(1e-3, 1e-4)}});
  }
  return out;
}

double error_at_the_end(const MapEstimate& map, RobotId robot) {
  const auto of_robot = [&](const MapNode& node) { return node.id.chain.robot == robot; };
  const auto first = std::ranges::find_if(map.nodes, of_robot);
  const auto last = std::ranges::find_if(map.nodes.rbegin(), map.nodes.rend(), of_robot);
  const Pose3 truth = test::true_pose(robot, first->id.index).inverse() * test::true_pose(robot, last->id.index);
  return local(truth, first->T_world_body.inverse() * last->T_world_body).norm();
}

/// By how much the map misses what its closures measured.
double worst_closure_m(const MapEstimate& map) {
  double worst_m = 0.0;
  for (const JudgedClosure& judged : map.closures) {
    if (!judged.accepted) continue;
    const Pose3 in_map =
        find_node(map, judged.closure.from)->T_world_body.inverse() * find_node(map, judged.closure.to)->T_world_body;
    worst_m = std::max(worst_m, local(judged.closure.measurement.T_a_b, in_map).head<3>().norm());
  }
  return worst_m;
}

Refinements only(Refinement refinement) {
  Refinements out;
  out.add(std::move(refinement));
  return out;
}
Refinements only(std::vector<RefinedStep> steps) { return only(Refinement{.steps = std::move(steps)}); }

SubmapSet one_robot() {
  SubmapSet out;
  for (Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1)))
    out[submap.id] = std::make_shared<const Submap>(std::move(submap));
  return out;
}

TEST(Refinements, StepsTakeThePlaceOfOdometry) {
  const MapEstimate map = estimate_map(one_robot(), {}, {});
  ASSERT_GT(error_at_the_end(map, RobotId{0}), 0.05);
  const MapEstimate better = refined(map, one_robot(), only(true_steps(map)));
  EXPECT_LT(error_at_the_end(better, RobotId{0}), 1e-6);
  EXPECT_EQ(better.odometry_of_steps.size(), map.odometry_edges);
  for (const auto& [edge, covariance] : better.odometry_of_steps)
    EXPECT_NEAR(covariance(0, 0), 0.02 * 0.02, 1e-7);  // the odometry's own covariance, for those who ask
  EXPECT_EQ(local(better.nodes[0].T_world_body, map.nodes[0].T_world_body).norm(), 0.0);
}

TEST(Refinements, WithoutStepsOrForOtherKeyframesTheMapIsAsItWas) {
  const MapEstimate map = estimate_map(one_robot(), {}, {});
  EXPECT_EQ(error_at_the_end(refined(map, one_robot(), {}), RobotId{0}), error_at_the_end(map, RobotId{0}));
  const RefinedStep other{.from = {RobotId{5}, 3}, .measurement = {}};
  EXPECT_TRUE(refined(map, one_robot(), only({other})).odometry_of_steps.empty());
}

TEST(Refinements, ClosuresSayWhatTheRefinedKeyframesSay) {
  const test::TestVerifier verifier(1);
  const SubmapSet submaps = one_robot();
  VerdictSet verdicts;
  for (auto a = submaps.begin(); a != submaps.end(); ++a)
    for (auto b = std::next(a); b != submaps.end(); ++b)
      if (verifier.is_candidate(*a->second, *b->second))
        verdicts[{a->first, b->first}] = *verifier.verify(*a->second, *b->second, MemoryPayloadStore());
  const MapEstimate map = estimate_map(submaps, verdicts, {});
  ASSERT_GT(map.graph.edges.size(), map.odometry_edges);
  Refinement truth{.steps = true_steps(map)};
  const double off = error_at_the_end(refined(map, submaps, only(truth)), RobotId{0});  // drawn away by the closures
  const Pose3 T_world_truth = map.nodes[0].T_world_body * test::true_pose(RobotId{0}, 0).inverse();
  for (const MapNode& node : map.nodes)
    truth.T_world_body[node.id] = T_world_truth * test::true_pose(node.id.chain.robot, node.id.index);
  EXPECT_GT(off, 1e-4);
  EXPECT_GT(error_at_the_end(refined(map, submaps, only(truth)), RobotId{0}), 1e-4);  // these it does not know
  for (const auto& [pair, verdict] : verdicts) truth.closed.push_back(pair);
  EXPECT_LT(error_at_the_end(refined(map, submaps, only(truth)), RobotId{0}), 1e-6);
}

TEST(Refinements, OdometryThatFailedIsNoStepsPlace) {
  MapEstimate map = estimate_map(one_robot(), {}, {});
  map.failed_odometry.push_back({RobotId{0}, 20, 23, 1.0, 0.1});
  EXPECT_EQ(refined(map, one_robot(), only(true_steps(map))).odometry_of_steps.size(), map.odometry_edges - 3);
}

/// A server that is fed one submap after the other of two robots; every job is answered by an oracle.
class RefinedServer {
 public:
  explicit RefinedServer(int refine_every, MapServerState state = {})
      : server_({RobotId{0}, RobotId{1}}, verifier_, payloads_, {.refine_every = refine_every}, 1, std::move(state)) {
    server_.refine_with(oracle_);
  }
  static std::vector<SubmapMessage> messages() {
    std::vector<SubmapMessage> out;
    for (const std::uint32_t robot : {0U, 1U})
      for (Submap& submap : test::make_submaps(RobotId{robot}, {.keyframes = 61}, Rng(robot))) {
        submap.cloud = std::make_shared<const PointCloud>(PointCloud{{{1.0F, 2.0F, 3.0F}}});
        out.push_back({{RobotId{robot}, 0, submap.id.index}, std::move(submap)});
      }
    std::ranges::stable_sort(out, {}, [](const SubmapMessage& m) { return m.submap.id.index; });
    return out;
  }
  void take(const SubmapMessage& message) {
    ASSERT_TRUE(server_.receive(message).has_value());
    for (const VerificationJob& job : server_.take_jobs()) answer(job);
  }
  void answer(const VerificationJob& job) {
    ASSERT_TRUE(server_.receive(*verifier_->verify(*job.first, *job.second, *payloads_)).has_value());
  }
  std::optional<RefinementJob> update() {
    server_.optimise();
    return server_.take_refinement_job();
  }
  [[nodiscard]] Refinement answer(const RefinementJob& job) const {
    return oracle_->refine(job, server_.state().submaps, *payloads_).value();
  }
  /// Answers all until there is nothing new.
  std::vector<RefinementJob> settle() {
    std::vector<RefinementJob> jobs;
    for (int updates = 0; server_.has_news() || server_.is_unsettled(); ++updates) {
      EXPECT_LT(updates, 6);
      if (server_.has_news())
        server_.optimise();
      else
        server_.settle();
      if (auto job = server_.take_refinement_job()) {
        EXPECT_TRUE(server_.receive(answer(*job)).has_value());
        jobs.push_back(std::move(*job));
      }
    }
    return jobs;
  }
  MapServer& operator*() { return server_; }
  MapServer* operator->() { return &server_; }

 private:
  std::shared_ptr<const test::TestVerifier> verifier_ = std::make_shared<const test::TestVerifier>(1);
  std::shared_ptr<MemoryPayloadStore> payloads_ = std::make_shared<MemoryPayloadStore>();
  std::shared_ptr<const test::Oracle> oracle_ = std::make_shared<const test::Oracle>();
  MapServer server_;
};

std::vector<bool> whole(const std::vector<RefinementJob>& jobs) {
  std::vector<bool> out;
  for (const RefinementJob& job : jobs) out.push_back(job.whole);
  return out;
}

TEST(Refinements, AnAnswerIsNewsAndThenThereIsNoneLeft) {
  RefinedServer server(1);
  for (const SubmapMessage& message : RefinedServer::messages()) {
    server.take(message);
    EXPECT_EQ(whole(server.settle()), std::vector{true});
  }
  EXPECT_LT(error_at_the_end(server->map(), RobotId{0}), 1e-6);
  EXPECT_LT(error_at_the_end(server->map(), RobotId{1}), 1e-6);
  const std::uint64_t revision = server->state().revision;
  EXPECT_FALSE(server.update().has_value());  // nothing new
  EXPECT_EQ(server->state().revision, revision + 1);
  EXPECT_EQ(server->state().refinements.all().size(), 1U);
}

TEST(Refinements, BetweenThoseOfTheWholeOnesOfWhatIsNew) {
  RefinedServer server(4);
  std::vector<RefinementJob> jobs;
  for (const SubmapMessage& message : RefinedServer::messages()) {
    server.take(message);
    auto job = server.update();
    ASSERT_TRUE(job.has_value());
    EXPECT_TRUE(server->receive(server.answer(*job)).has_value());
    EXPECT_LE(server->state().refinements.all().size(), 4U);
    jobs.push_back(std::move(*job));
  }
  std::size_t parts = 0, in_a_row = 0;
  for (const RefinementJob& job : jobs) {
    const auto free = std::ranges::count_if(job.parts, [](const auto& part) { return part.is_free; });
    in_a_row = job.whole ? 0 : in_a_row + 1;
    parts += job.whole ? 0 : 1;
    EXPECT_LT(in_a_row, 4U);
    EXPECT_TRUE(!job.whole || free == static_cast<std::ptrdiff_t>(job.parts.size()));
    EXPECT_TRUE(job.whole || free <= 3);  // it, and what is before and after it
  }
  EXPECT_GT(parts, 5U);
  EXPECT_LT(parts, jobs.size());
  EXPECT_EQ(server->is_unsettled(), !jobs.back().whole);
  EXPECT_EQ(whole(server.settle()), std::vector<bool>(jobs.back().whole ? 0 : 1, true));  // when no more comes
  EXPECT_LT(error_at_the_end(server->map(), RobotId{0}), 1e-6);
  EXPECT_LT(error_at_the_end(server->map(), RobotId{1}), 1e-6);
}

TEST(Refinements, WhatAJobFixesIsWhereTheMapHasIt) {
  RefinedServer server(100);
  const auto messages = RefinedServer::messages();
  for (std::size_t i = 0; i + 1 < messages.size(); ++i) server.take(messages[i]);
  server.settle();
  server.take(messages.back());
  const auto job = server.update();
  ASSERT_TRUE(job && !job->whole);
  for (const RefinementJob::Part& part : job->parts)
    for (std::size_t k = 0; k < part.T_world_body.size(); ++k) {
      const KeyframeId id{part.submap.chain, server->state().submaps.at(part.submap)->keyframes[k].index};
      const auto node = std::ranges::lower_bound(server->map().nodes, id, {}, &MapNode::id);
      EXPECT_EQ(part.T_world_body[k], node->T_world_body);
    }
}

/// Answers come late, twice, out of order, or never, and submaps without an update between them.
TEST(Refinements, InAnyOrderTheyEndInOneMap) {
  const auto messages = RefinedServer::messages();
  RefinedServer undisturbed(3);
  for (const SubmapMessage& message : messages) undisturbed.take(message);
  undisturbed.settle();
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    Rng rng(seed);
    RefinedServer server(3);
    std::vector<Refinement> late;
    const auto hand_in = [&](double share) {
      for (std::size_t i = late.size(); i > 1; --i) std::swap(late[i - 1], late[rng.index(i)]);
      for (const Refinement& refinement : late) {
        if (rng.bernoulli(share)) {
          EXPECT_TRUE(server->receive(refinement).has_value());
        }
      }
    };
    for (std::size_t i = 0; i < messages.size(); ++i) {
      server.take(messages[i]);
      if (rng.bernoulli(0.3)) continue;
      if (const auto job = server.update()) {
        const bool is_lost = rng.bernoulli(0.3) && i + 1 < messages.size();
        if (!is_lost || rng.bernoulli(0.5)) late.push_back(server.answer(*job));
        if (is_lost) server->give_up_refinement();
      }
      hand_in(0.5);
    }
    hand_in(1.0);
    server.settle();
    const MapEstimate &map = server->map(), &expected = undisturbed->map();
    ASSERT_EQ(map.nodes.size(), expected.nodes.size());
    for (std::size_t k = 0; k < map.nodes.size(); ++k)
      ASSERT_EQ(map.nodes[k].T_world_body, expected.nodes[k].T_world_body) << "seed " << seed;
  }
}

/// A refinement of two maps that nothing joined has them in unrelated frames. The closures that join them then place
/// them as they measured, until a refinement includes them.
TEST(Refinements, WhatItHadInUnrelatedFramesTiesNothing) {
  RefinedServer server(5);
  std::vector<VerificationJob> between;
  for (const SubmapMessage& message : RefinedServer::messages()) {
    ASSERT_TRUE(server->receive(message).has_value());
    for (VerificationJob& pair : server->take_jobs())
      if (pair.pair.first.chain != pair.pair.second.chain)
        between.push_back(std::move(pair));
      else
        server.answer(pair);
  }
  const auto job = server.update();
  ASSERT_TRUE(job.has_value() && server->map().components == 2U);
  Refinement refinement = server.answer(*job);  // the oracle knows where the two are; a real one has no way to know
  for (auto& [id, T_world_body] : refinement.T_world_body)
    if (id.chain.robot == RobotId{1}) T_world_body = Pose3{Eigen::Quaterniond(0, 0, 1, 0), {3, 4, 5}} * T_world_body;
  ASSERT_TRUE(server->receive(refinement).has_value());
  for (const VerificationJob& pair : between) server.answer(pair);
  ASSERT_TRUE(server.update().has_value());
  ASSERT_EQ(server->map().components, 1U);
  EXPECT_LT(worst_closure_m(server->map()), 0.1);
}

TEST(Refinements, WhatIsGivenUpIsAskedForWhenSomethingNewHasCome) {
  const auto messages = RefinedServer::messages();
  RefinedServer server(1);
  server.take(messages[0]);
  ASSERT_TRUE(server.update().has_value());
  EXPECT_FALSE(server.update().has_value());  // one at a time
  server->give_up_refinement();
  EXPECT_FALSE(server.update().has_value());
  EXPECT_TRUE(server->map().odometry_of_steps.empty());
  server.take(messages[2]);
  EXPECT_TRUE(server.update().has_value());
}

TEST(Refinements, ARestoredServerHasThemAndAsksForWhatIsMissing) {
  const auto messages = RefinedServer::messages();
  RefinedServer server(3);
  for (std::size_t i = 0; i + 2 < messages.size(); ++i) server.take(messages[i]);
  server.settle();
  RefinedServer restored(3, server->state());
  restored->rebuild();
  EXPECT_FALSE(restored->take_refinement_job().has_value());
  for (std::size_t k = 0; k < server->map().nodes.size(); ++k)
    ASSERT_EQ(restored->map().nodes[k].T_world_body, server->map().nodes[k].T_world_body);
  server.take(messages.back());
  ASSERT_TRUE(server.update().has_value());
  RefinedServer again(3, server->state());
  again->rebuild();
  EXPECT_TRUE(again->take_refinement_job().has_value());  // that of the first is lost
}

TEST(Refinements, WhatIsNoneOfThisMapIsRefused) {
  RefinedServer server(1);
  server.take(RefinedServer::messages().front());
  Refinement refinement = server.answer(server.update().value());
  const auto refused = [&](const Refinement& r) { return !server->receive(r).has_value() && !server->has_news(); };
  Refinement bad = refinement;
  bad.revision = 2;
  EXPECT_TRUE(refused(bad));
  bad = refinement;
  bad.why = "no cloud";
  EXPECT_TRUE(refused(bad));
  bad = refinement;
  bad.steps.front().measurement.covariance(0, 0) = -1.0;
  EXPECT_TRUE(refused(bad));
  EXPECT_FALSE(refused(refinement));
}

}  // namespace refinements_test
}  // namespace tutti::server
