// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/signal.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <numbers>

#include "tutti/consistency/testing/runs.hpp"

namespace tutti::consistency {
namespace {

TEST(Signal, UnknownNameIsAConfigurationError) {
  const auto signal = make_signal("loudness");
  ASSERT_FALSE(signal.has_value());
  EXPECT_EQ(signal.error().code, ErrorCode::configuration);
}

TEST(Signal, ShapesOfNothingAndOne) {
  for (const char* name : {"distance", "pose", "relative_motion"}) {
    const auto signal = *make_signal(name);
    EXPECT_EQ(signal->name(), name);
    EXPECT_EQ(signal->evaluate({}).rows(), 0);
    EXPECT_EQ(signal->difference({}, {}).rows(), 0);
    const std::vector<Pose3> one{test::corridor(1)};
    EXPECT_EQ(signal->evaluate(one).rows(), 1);
    EXPECT_TRUE(signal->evaluate(one).leftCols(signal->metres()).isZero());
    EXPECT_TRUE(signal->difference(one, one).isZero());
  }
}

TEST(Signal, DistanceIsThePapers) {
  const std::vector<Pose3> poses{test::at(1, 2, 3), test::at(4, 6, 3), test::at(1, 2, 5)};
  EXPECT_TRUE(DistanceSignal().evaluate(poses).isApprox(Eigen::Vector3d(0, 5, 2)));
}

RC_GTEST_PROP(Signal, NoneDependsOnTheFrame, (std::uint64_t seed)) {
  Rng rng(seed);
  const auto poses = test::corridor(80);
  const auto elsewhere = test::moved(test::random_pose(rng, 50.0), poses);
  for (const char* name : {"distance", "pose", "relative_motion"}) {
    const auto signal = *make_signal(name);
    RC_ASSERT((signal->evaluate(poses) - signal->evaluate(elsewhere)).cwiseAbs().maxCoeff() < 1e-10);
  }
}

// DESIGN.md, section 3: half of the trajectory turned by 20 degrees about node 0, 11.8 m error.
TEST(Signal, OnlyRelativeMotionSeesATurnAboutNodeZero) {
  const auto poses = test::corridor(70);
  auto turned = poses;
  const Pose3 turn = poses[0] *
                     Pose3{so3_exp(Eigen::Vector3d(0, 0, 20 * std::numbers::pi / 180)), Eigen::Vector3d::Zero()} *
                     poses[0].inverse();
  for (std::size_t n = 35; n < 70; ++n) turned[n] = turn * poses[n];
  const auto change = [&](const Signal& signal) {
    return (signal.evaluate(poses) - signal.evaluate(turned)).rowwise().norm().eval();
  };
  EXPECT_LT(change(DistanceSignal()).maxCoeff(), 1e-12);
  const auto seen = change(RelativeMotionSignal());
  Eigen::Index where = 0;
  EXPECT_GT(seen.maxCoeff(&where), 1.0);
  EXPECT_EQ(where, 35);
  EXPECT_LT(seen.head(35).maxCoeff(), 1e-12);
  EXPECT_LT(seen.tail(34).maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace tutti::consistency
