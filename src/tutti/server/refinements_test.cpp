// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_refiner.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

#include "support/server/world.hpp"
#include "tutti/server/map_server.hpp"

namespace tutti::server {
namespace {

/// The true steps of every chain, known to a millimetre.
std::vector<RefinedStep> true_steps(const MapEstimate& map) {
  std::vector<RefinedStep> out;
  for (std::size_t i = 0; i + 1 < map.nodes.size(); ++i) {
    const KeyframeId a = map.nodes[i].id, b = map.nodes[i + 1].id;
    if (a.chain != b.chain) continue;
    const Pose3 step = test::true_pose(a.chain.robot, a.index).inverse() * test::true_pose(b.chain.robot, b.index);
    out.push_back({a, {step, test::diagonal_covariance(1e-3, 1e-4)}});
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

SubmapSet one_robot() {
  SubmapSet out;
  for (Submap& submap : test::make_submaps(RobotId{0}, {}, Rng(1)))
    out[submap.id] = std::make_shared<const Submap>(std::move(submap));
  return out;
}

TEST(MapRefiner, StepsTakeThePlaceOfOdometry) {
  const MapEstimate map = estimate_map(one_robot(), {}, {});
  ASSERT_GT(error_at_the_end(map, RobotId{0}), 0.05);
  const MapEstimate better = refined(map, {true_steps(map), {}});
  EXPECT_LT(error_at_the_end(better, RobotId{0}), 1e-6);
  EXPECT_EQ(better.odometry_of_steps.size(), map.odometry_edges);
  for (const auto& [edge, covariance] : better.odometry_of_steps)
    EXPECT_NEAR(covariance(0, 0), 0.02 * 0.02, 1e-7);  // what the odometry says of itself, for those who ask
  EXPECT_EQ(local(better.nodes[0].T_world_body, map.nodes[0].T_world_body).norm(), 0.0);
}

TEST(MapRefiner, WithoutStepsOrForOtherKeyframesTheMapIsAsItWas) {
  const MapEstimate map = estimate_map(one_robot(), {}, {});
  EXPECT_EQ(error_at_the_end(refined(map, {}), RobotId{0}), error_at_the_end(map, RobotId{0}));
  const RefinedStep other{.from = {RobotId{5}, 3}, .measurement = {}};
  EXPECT_TRUE(refined(map, {{other}, {}}).odometry_of_steps.empty());
}

TEST(MapRefiner, ClosuresSayWhatTheRefinedKeyframesSay) {
  const test::TestFinder finder(1);
  const SubmapSet submaps = one_robot();
  VerdictSet verdicts;
  for (auto a = submaps.begin(); a != submaps.end(); ++a)
    for (auto b = std::next(a); b != submaps.end(); ++b)
      if (finder.is_candidate(*a->second, *b->second))
        verdicts[{a->first, b->first}] = *finder.verify(*a->second, *b->second, MemoryPayloadStore());
  const MapEstimate map = estimate_map(submaps, verdicts, {});
  ASSERT_GT(map.graph.edges.size(), map.odometry_edges);
  Refinement truth{true_steps(map), {}};
  const double off = error_at_the_end(refined(map, truth), RobotId{0});  // drawn away by the closures
  const Pose3 T_world_truth = map.nodes[0].T_world_body * test::true_pose(RobotId{0}, 0).inverse();
  for (const MapNode& node : map.nodes)
    truth.T_world_body[node.id] = T_world_truth * test::true_pose(node.id.chain.robot, node.id.index);
  EXPECT_GT(off, 1e-4);
  EXPECT_LT(error_at_the_end(refined(map, truth), RobotId{0}), 1e-6);
}

TEST(MapRefiner, OdometryThatFailedIsNoStepsPlace) {
  MapEstimate map = estimate_map(one_robot(), {}, {});
  map.failed_odometry.push_back({RobotId{0}, 20, 23, 1.0, 0.1});
  EXPECT_EQ(refined(map, {true_steps(map), {}}).odometry_of_steps.size(), map.odometry_edges - 3);
}

/// Knows the truth, or fails.
class Oracle final : public MapRefiner {
 public:
  [[nodiscard]] Result<Refinement> refine(const MapToRefine& map) const override {
    ++calls;
    if (fails) return fail(ErrorCode::invalid, "no map today");
    return Refinement{true_steps(map.estimate), {}};
  }
  mutable int calls = 0;
  bool fails = false;
};

TEST(MapRefiner, TheServerAsksEverySoOftenAndKeepsWhatItWasTold) {
  const auto oracle = std::make_shared<Oracle>();
  MapServer server({RobotId{0}}, std::make_shared<const test::TestFinder>(1), std::make_shared<MemoryPayloadStore>(),
                   {.refine_every = 3}, 1);
  server.refine_with(oracle);
  const auto submaps = test::make_submaps(RobotId{0}, {}, Rng(1));
  std::uint64_t sequence = 0;
  for (const Submap& submap : submaps) {
    ASSERT_TRUE(server.receive({.header = {RobotId{0}, 0, sequence++}, .submap = submap}).has_value());
    server.optimise();
  }
  EXPECT_EQ(oracle->calls, 1 + static_cast<int>(submaps.size()) / 3);
  EXPECT_LT(error_at_the_end(server.map(), RobotId{0}), 0.1);
  const std::size_t known = server.map().odometry_of_steps.size();
  oracle->fails = true;
  for (int i = 0; i < 3; ++i) server.optimise();
  EXPECT_EQ(server.map().odometry_of_steps.size(), known);
  ASSERT_EQ(server.take_late_errors().size(), 1U);
}

}  // namespace
}  // namespace tutti::server
