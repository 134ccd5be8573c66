// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/joints.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <limits>

#include "tutti/consistency/testing/runs.hpp"

namespace tutti::consistency::internal {
namespace {

constexpr double kLever_m = 0.3;

OdometryError drifting(std::size_t nodes, std::uint64_t seed, const test::OdometryNoise& noise) {
  const auto server = test::corridor(nodes);
  std::vector<RelativePose> odometry{RelativePose{}};
  for (const Pose3& T : test::odometry_increments(server, noise, Rng(seed)))
    odometry.push_back({T, test::covariance_of(noise)});
  return {server, odometry, kLever_m};
}

/// Odometry that follows the server's map but for one step.
OdometryError one_jump(std::size_t nodes, std::size_t step, const Pose3& jump) {
  const auto server = test::corridor(nodes);
  std::vector<RelativePose> odometry;
  for (std::size_t k = 0; k < nodes; ++k) {
    RelativePose next{.covariance = test::covariance_of({})};
    if (k > 0) next.T_a_b = server[k - 1].inverse() * server[k];
    if (k == step) next.T_a_b = next.T_a_b * jump;
    odometry.push_back(next);
  }
  return {server, odometry, kLever_m};
}

/// Placed and fitted by the same measure.
JointPlan plan_joints(const OdometryError& error, std::size_t max_links, double least_gain,
                      std::size_t candidates = 200) {
  return fit_joints(error, place_joints(error, max_links, least_gain, candidates));
}

/// Summed squared error with these nodes held exactly where the server has them.
double held_exactly(const OdometryError& error, const std::vector<std::size_t>& joints) {
  double sum = error.hanging(joints.front(), 0, joints.front());
  for (std::size_t j = 1; j < joints.size(); ++j) sum += error.bridged(joints[j - 1], joints[j]);
  return sum + error.hanging(joints.back(), joints.back(), error.size() - 1);
}

/// The least of all sets of joints.
double exhaustive(const OdometryError& error, std::size_t max_links, double least_gain) {
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t set = 1; set < (1U << error.size()); ++set) {
    const auto links = static_cast<std::size_t>(std::popcount(set)) - 1;
    if (links > max_links) continue;
    std::vector<std::size_t> joints;
    for (std::size_t k = 0; k < error.size(); ++k)
      if ((set >> k & 1U) != 0) joints.push_back(k);
    least = std::min(least, held_exactly(error, joints) + static_cast<double>(links) * least_gain);
  }
  return least;
}

RC_GTEST_PROP(PlanJoints, NoSetOfJointsIsBetter, (std::uint64_t seed)) {
  const auto nodes = *rc::gen::inRange<std::size_t>(1, 13);
  const auto error = drifting(nodes, seed, {.translation_m = 0.05, .rotation_rad = 0.01});
  const std::size_t max_links = *rc::gen::inRange<std::size_t>(0, 4);
  const double gain = held_exactly(error, {0}) * std::pow(10.0, -*rc::gen::inRange(1, 5));
  const JointPlan plan = plan_joints(error, max_links, gain);
  const double cost = held_exactly(error, plan.joints) + static_cast<double>(plan.joints.size() - 1) * gain;
  const double least = exhaustive(error, max_links, gain);
  RC_ASSERT(cost <= least * (1.0 + 1e-9) + 1e-18);
}

RC_GTEST_PROP(PlanJoints, AreSortedWithinTheLimitAndFittingOnlyHelps, (std::uint64_t seed)) {
  const auto nodes = *rc::gen::inRange<std::size_t>(2, 300);
  const auto error = drifting(nodes, seed, {.translation_m = 0.02, .rotation_rad = 0.002, .yaw_bias_rad = 1e-3});
  const auto max_links = *rc::gen::inRange<std::size_t>(0, 8);
  const auto candidates = *rc::gen::inRange<std::size_t>(2, 60);
  const JointPlan plan = plan_joints(error, max_links, 1e-4, candidates);
  RC_ASSERT(!plan.joints.empty());
  RC_ASSERT(plan.joints.size() <= max_links + 1);
  RC_ASSERT(plan.offsets.size() == plan.joints.size());
  for (std::size_t j = 1; j < plan.joints.size(); ++j) RC_ASSERT(plan.joints[j - 1] < plan.joints[j]);
  RC_ASSERT(plan.joints.back() < nodes);
  RC_ASSERT(plan.squared_error <= held_exactly(error, plan.joints) * (1.0 + 1e-9) + 1e-15);
}

// More links never leave more, and every one of them pays.
TEST(PlanJoints, MoreLinksLeaveLessAndEachPays) {
  const auto error = drifting(250, 3, {});
  double before = std::numeric_limits<double>::infinity();
  std::size_t links_before = 0;
  for (const std::size_t most : {0U, 1U, 2U, 4U, 8U, 16U}) {
    const auto plan = plan_joints(error, most, 1e-3);
    const double left = held_exactly(error, plan.joints);
    EXPECT_LE(left + 1e-3 * static_cast<double>(plan.joints.size() - 1),
              before + 1e-3 * static_cast<double>(links_before));
    before = left;
    links_before = plan.joints.size() - 1;
  }
  EXPECT_GE(links_before, 4U);
}

TEST(PlanJoints, NoLinkWhereOdometryAgrees) {
  for (const std::size_t nodes : {1U, 2U, 100U}) {
    const auto plan = plan_joints(one_jump(nodes, 0, {}), 20, 1e-6);
    EXPECT_EQ(plan.joints.size(), 1U);
    EXPECT_LT(plan.squared_error, 1e-12);
  }
}

TEST(PlanJoints, OneLinkTightAroundASingleJump) {
  for (const std::size_t step : {1U, 37U, 150U, 299U}) {
    const auto plan =
        plan_joints(one_jump(300, step, {so3_exp(Eigen::Vector3d(0, 0, 0.02)), {0.3, -0.4, 0.1}}), 20, 0.01);
    EXPECT_EQ(plan.joints, (std::vector<std::size_t>{step - 1, step}));
    EXPECT_LT(plan.squared_error, 1e-3);
  }
}

// On runs with many more nodes than candidates, too.
TEST(PlanJoints, FindsTheNodeBetweenTheCandidates) {
  for (const std::size_t step : {101U, 1013U, 2222U, 2900U}) {
    const auto plan = plan_joints(one_jump(3000, step, test::at(0.3, -0.4, 0.1)), 20, 0.01, 100);
    EXPECT_EQ(plan.joints, (std::vector<std::size_t>{step - 1, step}));
  }
}

// Two failures that undo each other: the first link pays little without the second.
TEST(PlanJoints, LooksAheadOverALinkThatHardlyPays) {
  const auto server = test::corridor(200);
  std::vector<RelativePose> odometry;
  for (std::size_t k = 0; k < server.size(); ++k) {
    RelativePose next{.covariance = test::covariance_of({})};
    if (k > 0) next.T_a_b = server[k - 1].inverse() * server[k];
    if (k == 60) next.T_a_b.translation.z() += 1.0;
    if (k == 120) next.T_a_b.translation.z() -= 1.0;
    odometry.push_back(next);
  }
  const OdometryError error(server, odometry, kLever_m);
  const auto plan = plan_joints(error, 20, 0.5);
  EXPECT_LT(held_exactly(error, plan.joints), 0.1);
  EXPECT_EQ(plan.joints, (std::vector<std::size_t>{59, 60, 119, 120}));
}

}  // namespace
}  // namespace tutti::consistency::internal
