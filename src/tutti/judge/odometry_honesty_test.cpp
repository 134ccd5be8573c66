// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/odometry_honesty.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/random_pose.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::judge {
namespace odometry_honesty_test {

constexpr RobotId kRobot{0};
constexpr std::uint32_t kKeyframes = 400;
constexpr double kStep_m = 0.03, kStep_rad = 0.004;  // what odometry is truly good for
constexpr double kClosure_m = 0.05, kClosure_rad = 0.01;

struct Case {
  double stated = 1.0;  ///< Standard deviation of rotations as stated, over the true one.
  std::size_t closures = 80;
  double wrong_share = 0.0;
  double scale = 1.0;                  ///< Odometry's translations'.
  double stated_m = 1.0;               ///< As `stated`, of translations.
  std::uint32_t longest = kKeyframes;  ///< The longest loop's keyframes.
};

OdometryHonesty honesty(const Case& c, std::uint64_t seed) {
  Rng rng(seed);
  OdometrySegment chain{.id = kRobot, .index = {0}, .T_odom_body = {Pose3{}}};
  std::vector<Pose3> truth(1);
  for (std::uint32_t k = 1; k < kKeyframes; ++k) {
    chain.index.push_back(k);
    const Pose3 step{so3_exp(Eigen::Vector3d(0, 0, 0.1)), Eigen::Vector3d(1, 0, 0)};
    Pose3 measured = retract(step, test::draw(rng, kStep_m, kStep_rad));
    measured.translation *= c.scale;
    truth.push_back(truth.back() * step);
    chain.T_odom_body.push_back(chain.T_odom_body.back() * measured);
    chain.step_covariance.push_back(diagonal_covariance(kStep_m * c.stated_m, kStep_rad * c.stated));
  }
  std::vector<LoopClosure> closures;
  while (closures.size() < c.closures) {
    const auto a = static_cast<std::uint32_t>(rng.index(kKeyframes));
    const auto b = static_cast<std::uint32_t>(rng.index(kKeyframes));
    if (const auto apart = std::max(a, b) - std::min(a, b); apart < 40 || apart > c.longest) continue;
    Pose3 T_a_b = retract(truth[a].inverse() * truth[b], test::draw(rng, kClosure_m, kClosure_rad));
    if (rng.bernoulli(c.wrong_share)) T_a_b = T_a_b * Pose3{so3_exp(Eigen::Vector3d(0, 0, 1.0)), {3, 2, 1}};
    closures.push_back({{kRobot, a}, {kRobot, b}, {T_a_b, diagonal_covariance(kClosure_m, kClosure_rad)}});
  }
  const std::vector<OdometrySegment> odometry{chain};
  return odometry_honesty(odometry, closures).at(kRobot);
}

double factor(const Case& c, std::uint64_t seed) { return honesty(c, seed).rotation; }

constexpr std::uint64_t kSeeds = 20;

TEST(OdometryHonesty, SeesHowMuchIsOverstated) {
  for (const double stated : {2.0, 3.0, 4.0}) {
    std::vector<double> ratios;  // of the factor to the true one
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
      ratios.push_back(factor({.stated = stated}, seed) * stated * stated);
    std::ranges::sort(ratios);
    EXPECT_NEAR(ratios[kSeeds / 2], 2.0, 0.7) << stated;  // twice as careful as it would have to be,
    EXPECT_GT(ratios.front(), 0.7) << stated;             // which is what one walk may be wrong by
  }
}

TEST(OdometryHonesty, HonestAndUnderstatedRotationsStayAsTheyAre) {
  std::size_t untouched = 0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    EXPECT_GT(factor({}, seed), 0.7) << seed;
    untouched += factor({}, seed) == 1.0 ? 1 : 0;
    EXPECT_EQ(factor({.stated = 0.3}, seed), 1.0) << seed;
  }
  EXPECT_GE(untouched, kSeeds * 3 / 4);
}

TEST(OdometryHonesty, WrongClosuresMakeItCarefulOnly) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    EXPECT_GE(factor({.stated = 4.0, .wrong_share = 0.15}, seed), 0.7 / 16.0) << seed;
    EXPECT_LT(factor({.stated = 4.0, .wrong_share = 0.15}, seed), 1.0) << seed;
    EXPECT_EQ(factor({.stated = 4.0, .wrong_share = 0.5}, seed), 1.0) << seed;
  }
}

TEST(OdometryHonesty, AScaleErrorIsNoneOfItsBusiness) {
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
    EXPECT_NEAR(factor({.stated = 3.0, .scale = 1.05}, seed), factor({.stated = 3.0}, seed), 1e-9);
}

TEST(OdometryHonesty, StaysWithinItsBounds) {
  EXPECT_EQ(factor({.stated = 4.0, .closures = 7}, 1), 1.0);  // too few to judge
  EXPECT_GE(factor({.stated = 100.0}, 1), 0.04);
  EXPECT_LT(factor({.stated = 100.0}, 1), 0.12);
  EXPECT_TRUE(odometry_honesty({}, {}).empty());
}

// Judged closures measure the whole odometry, in either order.
TEST(OdometryHonesty, SeesHowMuchTheWholeIsOverstatedOrUnderstated) {
  for (const double stated : {0.15, 0.5, 1.0, 3.0}) {
    std::vector<double> ratios;  // of the factor to the true one
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
      ratios.push_back(honesty({.stated = stated, .stated_m = stated}, seed).whole * stated * stated);
    std::ranges::sort(ratios);
    EXPECT_NEAR(ratios[kSeeds / 2], stated > 1.0 ? 2.0 : 1.0, 0.5) << stated;  // careful, where it is lowered
    EXPECT_GT(ratios.front(), stated > 1.0 ? 0.8 : 0.3) << stated;
    EXPECT_LT(ratios.back(), stated > 1.0 ? 4.0 : 3.0) << stated;
  }
}

// As many loops, but over a twentieth of the distance: they share less odometry, so their factor is nearly taken as it
// is.
TEST(OdometryHonesty, LoopsThatShareNoOdometryAreBelievedMore) {
  double of_long = 0.0, of_short = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    of_long += honesty({.stated = 3.0, .stated_m = 3.0}, seed).whole / kSeeds;
    of_short += honesty({.stated = 3.0, .stated_m = 3.0, .longest = 50}, seed).whole / kSeeds;
  }
  EXPECT_GT(of_short, 1.0 / 9.0);
  EXPECT_LT(of_short, 1.5 / 9.0);
  EXPECT_GT(of_long, 1.25 * of_short);
}

// Closures that measure little of odometry, as they share nearly all of it, do not make the map surer than it is.
TEST(OdometryHonesty, HonestOdometryKeepsItsCovariance) {
  for (const std::size_t closures : {10, 20, 80}) {
    std::size_t lowered = 0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
      const OdometryHonesty found = honesty({.closures = closures}, seed);
      EXPECT_GT(std::min(found.rotation, found.whole), 0.6) << closures << ", " << seed;
      lowered += found.whole < 0.9 ? 1 : 0;
    }
    EXPECT_LE(lowered, kSeeds / 5) << closures;
  }
}

TEST(OdometryHonesty, ScalesOnlyRotations) {
  EXPECT_LT((scale_rotation(diagonal_covariance(2.0, 2.0), 0.25) - diagonal_covariance(2.0, 1.0)).norm(), 1e-12);
}

}  // namespace odometry_honesty_test
}  // namespace tutti::judge
