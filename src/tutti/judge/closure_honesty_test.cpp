// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/closure_honesty.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/random_pose.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::judge {
namespace closure_honesty_test {

constexpr RobotId kOne{0}, kTwo{1};
constexpr std::uint32_t kLength = 400;
constexpr double kOdometry_m = 0.01, kOdometry_rad = 0.002;  // a step
constexpr double kError_m = 0.05, kError_rad = 0.01;         // of closures

struct Case {
  double stated_m = 1.0;  ///< Standard deviations of the closures as stated, over the true ones.
  double stated_rad = 1.0;
  std::size_t closures = 80;
  double wrong_share = 0.0;
  double scale = 1.0;  ///< All lengths'.
};

OdometrySegment chain_of(RobotId robot, const Case& c, Rng& rng, std::vector<Pose3>& truth) {
  OdometrySegment chain{.id = robot, .index = {0}, .T_odom_body = {Pose3{}}};
  truth.assign(1, {});
  for (std::uint32_t k = 1; k < kLength; ++k) {
    chain.index.push_back(k);
    const Pose3 step{so3_exp(Eigen::Vector3d(0, 0, 0.1)), Eigen::Vector3d(c.scale, 0, 0)};
    truth.push_back(truth.back() * step);
    chain.T_odom_body.push_back(chain.T_odom_body.back() *
                                retract(step, test::draw(rng, c.scale * kOdometry_m, kOdometry_rad)));
    chain.step_covariance.push_back(diagonal_covariance(c.scale * kOdometry_m, kOdometry_rad));
  }
  return chain;
}

void add_closures(const Case& c, RobotId first, RobotId second, const std::vector<Pose3>& one,
                  const std::vector<Pose3>& two, Rng& rng, std::vector<LoopClosure>& closures) {
  for (std::size_t k = 0; k < c.closures; ++k) {
    const auto a = static_cast<std::uint32_t>(rng.index(kLength));
    const auto b = std::min(kLength - 1, a + static_cast<std::uint32_t>(rng.index(5)));
    Pose3 T_a_b = retract(one[a].inverse() * two[b], test::draw(rng, c.scale * kError_m, kError_rad));
    if (rng.bernoulli(c.wrong_share)) T_a_b = T_a_b * retract(Pose3{}, test::draw(rng, c.scale * 5.0, 1.0));
    closures.push_back({{first, a},
                        {second, b},
                        {T_a_b, diagonal_covariance(c.scale * kError_m * c.stated_m, kError_rad * c.stated_rad)}});
  }
}

/// The honesty found for the closures between two robots.
ClosureHonesty found(const Case& c, std::uint64_t seed) {
  Rng rng(seed);
  std::vector<Pose3> one, two;
  const std::vector<OdometrySegment> odometry{chain_of(kOne, c, rng, one), chain_of(kTwo, c, rng, two)};
  std::vector<LoopClosure> closures;
  add_closures(c, kOne, kTwo, one, two, rng, closures);
  const auto all = closure_honesty(odometry, closures);
  const auto it = all.find({kOne, kTwo});
  return it == all.end() ? ClosureHonesty{} : it->second;
}

constexpr std::uint64_t kSeeds = 20;

TEST(ClosureHonesty, SeesByHowMuchRotationsAreUnderstated) {
  for (const double stated : {0.2, 0.3}) {
    std::vector<double> ratios;  // of the factor to the true one
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const ClosureHonesty honesty = found({.stated_rad = stated}, seed);
      ratios.push_back(honesty.rotation * stated * stated);
      EXPECT_LT(honesty.translation, 3.0) << seed;
    }
    std::ranges::sort(ratios);
    EXPECT_NEAR(ratios[kSeeds / 2], 1.0, 0.4) << stated;
    EXPECT_GT(ratios.front(), 0.4) << stated;
    EXPECT_LT(ratios.back(), 2.5) << stated;
  }
}

TEST(ClosureHonesty, SeesByHowMuchTranslationsAreUnderstated) {
  std::vector<double> ratios;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
    ratios.push_back(found({.stated_m = 0.2}, seed).translation / 25.0);
  std::ranges::sort(ratios);
  EXPECT_NEAR(ratios[kSeeds / 2], 1.0, 0.4);
}

TEST(ClosureHonesty, HonestAndOverstatedClosuresStayAsTheyAre) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    EXPECT_LT(found({}, seed).rotation, 2.5) << seed;
    EXPECT_EQ(found({.stated_m = 3.0, .stated_rad = 3.0}, seed), ClosureHonesty{}) << seed;
  }
}

// A third of wrong closures spoils more than half of the pairs.
TEST(ClosureHonesty, WrongClosuresRaiseLittle) {
  for (const double wrong_share : {0.1, 0.3}) {
    std::vector<double> factors;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
      factors.push_back(found({.wrong_share = wrong_share}, seed).rotation);
    std::ranges::sort(factors);
    EXPECT_LT(factors[kSeeds / 2], 2.5) << wrong_share;
    EXPECT_LT(factors.back(), 6.0) << wrong_share;
  }
}

TEST(ClosureHonesty, KnowsNoLength) {
  for (const double scale : {0.01, 100.0}) {
    const ClosureHonesty near = found({.stated_m = 0.3, .stated_rad = 0.3}, 1);
    const ClosureHonesty other = found({.stated_m = 0.3, .stated_rad = 0.3, .scale = scale}, 1);
    EXPECT_NEAR(other.rotation / near.rotation, 1.0, 1e-3);
    EXPECT_NEAR(other.translation / near.translation, 1.0, 1e-3);
  }
}

// A large fleet has thousands of pairs of robots with a few closures each: chance alone made hundreds of them "err
// twice as much as they say", some by a factor of 286.
TEST(ClosureHonesty, AFleetOfHonestPairsIsBelievedAndOneThatUnderstatesIsFound) {
  constexpr std::uint32_t kRobots = 120;
  Rng rng(1);
  std::vector<std::vector<Pose3>> truth(kRobots);
  std::vector<OdometrySegment> odometry;
  std::vector<LoopClosure> closures;
  for (std::uint32_t r = 0; r < kRobots; ++r) odometry.push_back(chain_of(RobotId{r}, {}, rng, truth[r]));
  for (std::uint32_t r = 0; r + 1 < kRobots; ++r) {
    const Case understates{.stated_rad = 0.2, .closures = 60}, honest{.closures = 10 + r % 10};
    add_closures(r == 5 ? understates : honest, RobotId{r}, RobotId{r + 1}, truth[r], truth[r + 1], rng, closures);
  }
  const auto all = closure_honesty(odometry, closures);
  EXPECT_LE(all.size(), 3U);
  ASSERT_TRUE(all.contains({RobotId{5}, RobotId{6}}));
  EXPECT_GT(all.at({RobotId{5}, RobotId{6}}).rotation, 8.0);
}

TEST(ClosureHonesty, FewAreNotJudged) {
  EXPECT_EQ(found({.stated_rad = 0.1, .closures = 7}, 1), ClosureHonesty{});
  EXPECT_TRUE(closure_honesty({}, {}).empty());
}

}  // namespace closure_honesty_test
}  // namespace tutti::judge
