// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/map_estimate.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "tutti/geometry/alignment.hpp"
#include "tutti/server/testing/world.hpp"

namespace tutti::server {
namespace {

using test::TestFinder;

struct Inputs {
  SubmapSet submaps;
  VerdictSet verdicts;
};

Inputs make_inputs(std::uint32_t robots, const TestFinder& finder, std::uint64_t seed) {
  Inputs in;
  for (std::uint32_t r = 0; r < robots; ++r)
    for (Submap& submap : test::make_submaps({r}, {}, Rng(seed).fork(r)))
      in.submaps[submap.id] = std::make_shared<const Submap>(std::move(submap));
  for (auto a = in.submaps.begin(); a != in.submaps.end(); ++a)
    for (auto b = std::next(a); b != in.submaps.end(); ++b)
      if (finder.is_candidate(*a->second, *b->second))
        in.verdicts[{a->first, b->first}] = *finder.verify(*a->second, *b->second, MemoryCloudStore());
  return in;
}

/// RMSE of the positions of all nodes of one component after one rigid alignment.
double rmse(const MapEstimate& map, bool raw = false) {
  std::vector<Eigen::Vector3d> truth;
  std::vector<Eigen::Vector3d> estimate;
  for (const MapNode& node : map.nodes) {
    truth.push_back(test::true_pose(node.id.robot, node.id.index).translation);
    estimate.push_back(raw ? node.T_odom_body.translation : node.T_world_body.translation);
  }
  const Pose3 T = align_points(truth, estimate);
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum += (truth[i] - T * estimate[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

TEST(MapEstimate, IsEmptyWithoutSubmaps) {
  const MapEstimate map = estimate_map({}, {}, {});
  EXPECT_TRUE(map.nodes.empty());
  EXPECT_EQ(map.components, 0U);
}

TEST(MapEstimate, WithoutClosuresEveryRobotIsAComponentAndKeepsItsOdometry) {
  const Inputs in = make_inputs(2, TestFinder(1), 1);
  const MapEstimate map = estimate_map(in.submaps, {}, {});
  EXPECT_EQ(map.components, 2U);
  ASSERT_EQ(map.nodes.size(), 182U);  // 91 keyframes each, the shared ones once
  for (const MapNode& node : map.nodes) EXPECT_LT(local(node.T_odom_body, node.T_world_body).norm(), 1e-9);
}

TEST(MapEstimate, JoinsRobotsInUnknownFramesAndBeatsTheirOdometry) {
  const Inputs in = make_inputs(3, TestFinder(2), 2);
  const MapEstimate map = estimate_map(in.submaps, in.verdicts, {});
  EXPECT_TRUE(map.converged);
  EXPECT_EQ(map.components, 1U);
  EXPECT_LT(rmse(map), 0.08);
  EXPECT_GT(rmse(map, true), 1.0);  // three unrelated frames
}

TEST(MapEstimate, RejectsWrongClosures) {
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    const Inputs in = make_inputs(2, TestFinder(seed, 4), seed);
    const MapEstimate map = estimate_map(in.submaps, in.verdicts, {});
    std::size_t wrong = 0;
    std::size_t right = 0;
    for (const JudgedClosure& judged : map.closures) {
      const bool is_wrong = TestFinder::is_wrong(judged.closure);
      EXPECT_FALSE(is_wrong && judged.accepted);
      wrong += is_wrong ? 1 : 0;
      right += !is_wrong && judged.accepted ? 1 : 0;
    }
    EXPECT_GE(wrong, 2U);
    EXPECT_GT(right, 3 * wrong / 2);
    EXPECT_EQ(map.components, 1U);
    EXPECT_LT(rmse(map), 0.08);
  }
}

TEST(MapEstimate, SeesThroughRotationsThatAreBetterThanStated) {
  double judged = 0.0, stated = 0.0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Inputs in = make_inputs(2, TestFinder(seed), seed);
    for (auto& [id, submap] : in.submaps) {
      Submap overstated = *submap;
      for (RelativePose& odometry : overstated.odometry) odometry.covariance.bottomRightCorner<3, 3>() *= 100.0;
      submap = std::make_shared<const Submap>(std::move(overstated));
    }
    judged += rmse(estimate_map(in.submaps, in.verdicts, {}));
    stated += rmse(estimate_map(in.submaps, in.verdicts, {.judge_rotation = false}));
  }
  EXPECT_LT(judged, 0.9 * stated);
}

TEST(MapEstimate, ALoneClosureDoesNotJoinTwoRobots) {
  Inputs in = make_inputs(2, TestFinder(3), 3);
  const auto inter = std::find_if(in.verdicts.begin(), in.verdicts.end(), [](const auto& entry) {
    return entry.first.first.robot != entry.first.second.robot;
  });
  ASSERT_NE(inter, in.verdicts.end());
  const VerdictSet one{*inter};
  EXPECT_EQ(estimate_map(in.submaps, one, {}).components, 2U);
  EXPECT_EQ(estimate_map(in.submaps, one, {.trial = {.min_joining_closures = 1}}).components, 1U);
}

TEST(MapEstimate, AMissingSubmapLeavesAGapAndNothingElse) {
  Inputs in = make_inputs(1, TestFinder(4), 4);
  in.submaps.erase({RobotId{0}, 4});
  std::erase_if(in.verdicts,
                [](const auto& entry) { return entry.first.first.index == 4 || entry.first.second.index == 4; });
  const MapEstimate map = estimate_map(in.submaps, in.verdicts, {});
  EXPECT_EQ(map.nodes.size(), 91U - 9U);  // the keyframes that only submap 4 has
  EXPECT_TRUE(
      std::all_of(map.nodes.begin(), map.nodes.end(), [](const MapNode& n) { return is_valid(n.T_world_body); }));
}

TEST(MapEstimate, TheFirstPoseOfAComponentStaysWhereItsOdometryPutIt) {
  const Inputs in = make_inputs(2, TestFinder(5), 5);
  const MapEstimate map = estimate_map(in.submaps, in.verdicts, {});
  EXPECT_LT(local(map.nodes.front().T_odom_body, map.nodes.front().T_world_body).norm(), 1e-9);
}

}  // namespace
}  // namespace tutti::server
