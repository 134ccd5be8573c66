// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/failure_interval.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "tutti/estimation/testing/random_graphs.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::estimation {
namespace {

using namespace testing;

constexpr double kStep = 0.5;
constexpr std::size_t kSteps = 220;

struct Walk {
  std::vector<Pose3> truth;
  std::vector<Pose3> odometry;
  std::vector<Matrix6d> covariance;
};

/// 110 m with a corner every 25 m; between two poses the odometry misses `missed`, the same with every step.
Walk failing_walk(Rng& rng, std::size_t from, std::size_t to, const Vector6d& missed) {
  Walk walk{.truth = {random_pose(rng)}, .odometry = {random_pose(rng)}, .covariance = {}};
  for (std::size_t k = 0; k < kSteps; ++k) {
    const double turn = k % 50 == 25 ? 0.5 * M_PI : 0.0;
    const Pose3 step{so3_exp({0.0, 0.0, turn}), {kStep, 0.0, 0.0}};
    walk.covariance.push_back(random_covariance(rng, 0.005, 5e-4));
    Pose3 measured = retract(step, sample(rng, walk.covariance.back()));
    if (k >= from && k < to) measured = retract(measured, missed / static_cast<double>(to - from));
    walk.truth.push_back(walk.truth.back() * step);
    walk.odometry.push_back(walk.odometry.back() * measured);
  }
  return walk;
}

PoseSighting sighting(Rng& rng, const Walk& walk, std::size_t at, const Pose3& wrong_by = {}) {
  const Matrix6d covariance = random_covariance(rng, 0.05, 0.01);
  return {at, retract(walk.truth[at] * wrong_by, sample(rng, covariance)), covariance};
}

/// Every `every` poses, some wrong, and at both ends.
std::vector<PoseSighting> sightings(Rng& rng, const Walk& walk, std::size_t every, double wrong_share) {
  std::vector<PoseSighting> out{sighting(rng, walk, 0)};
  for (std::size_t k = every; k < kSteps; k += every)
    out.push_back(sighting(rng, walk, k, rng.bernoulli(wrong_share) ? random_pose(rng, 4.0, 0.8) : Pose3{}));
  out.push_back(sighting(rng, walk, kSteps));
  return out;
}

Vector6d missing(double up_m, double yaw_deg) {
  Vector6d missed = Vector6d::Zero();
  missed(2) = up_m;
  missed(5) = yaw_deg * kRadPerDeg;
  return missed;
}

double metres(std::size_t a, std::size_t b) { return kStep * static_cast<double>(a > b ? a - b : b - a); }

TEST(FailureInterval, IsWhatTheSightingsOnTheWaySay) {
  for (const Vector6d& missed : {missing(3.0, 0.0), missing(0.0, 10.0), missing(1.0, -20.0)})
    for (const double wrong_share : {0.0, 0.3})
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        Rng rng(seed);
        const std::size_t from = 40 + rng.index(60);
        const std::size_t to = from + 10 + rng.index(60);
        const Walk walk = failing_walk(rng, from, to, missed);
        const auto found = locate_failure(walk.odometry, walk.covariance, sightings(rng, walk, 8, wrong_share));
        ASSERT_TRUE(found);
        EXPECT_LE(metres(found->from, from), 5.0) << seed;
        EXPECT_LE(metres(found->to, to), 5.0) << seed;
      }
}

TEST(FailureInterval, IsWhereATurnMustHaveBeenWhenOnlyTheEndsAreSeen) {
  std::vector<double> off;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    Rng rng(seed);
    const std::size_t from = 50 + rng.index(60);
    const Walk walk = failing_walk(rng, from, from + 40, missing(0.0, 8.0));
    const auto found = locate_failure(walk.odometry, walk.covariance, sightings(rng, walk, kSteps, 0.0));
    ASSERT_TRUE(found);
    EXPECT_LT(found->from, from + 40) << seed;
    EXPECT_GT(found->to, from) << seed;
    EXPECT_NEAR(found->missed_rad, 8.0 * kRadPerDeg, 4.0 * kRadPerDeg) << seed;  // both ends are known to 1 degree
    off.push_back(metres((found->from + found->to) / 2, from + 20));
  }
  std::ranges::sort(off);
  EXPECT_LT(off[off.size() / 2], 4.0);  // of the middle
  EXPECT_LT(off.back(), 12.0);
}

TEST(FailureInterval, ASlipIsShort) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Rng rng(seed);
    const std::size_t at = 40 + rng.index(120);
    const Walk walk = failing_walk(rng, at, at + 1, missing(0.8, 10.0));
    const auto found = locate_failure(walk.odometry, walk.covariance, sightings(rng, walk, 8, 0.1));
    ASSERT_TRUE(found);
    EXPECT_LE(metres(found->from, at), 8.0) << seed;  // two sightings
    EXPECT_LE(metres(found->to, at), 8.0) << seed;
  }
}

TEST(FailureInterval, HasNoOpinionOnNothing) {
  Rng rng(1);
  const Walk walk = failing_walk(rng, 100, 120, missing(1.0, 0.0));
  const std::span<const Pose3> poses(walk.odometry);
  const std::span<const Matrix6d> covariance(walk.covariance);
  const std::vector<PoseSighting> two{sighting(rng, walk, 0), sighting(rng, walk, 1)};
  EXPECT_FALSE(locate_failure(poses.first(2), covariance.first(1), two));
  // A sighting that is no number counts as a wrong one.
  auto seen = sightings(rng, walk, 8, 0.0);
  const auto before = locate_failure(poses, covariance, seen);
  PoseSighting broken = seen[3];
  broken.T_world_body.translation.x() = std::numeric_limits<double>::quiet_NaN();
  seen.insert(seen.begin() + 4, broken);
  broken = seen[3];
  broken.covariance(2, 2) = -1.0;
  seen.insert(seen.begin() + 4, broken);
  const auto after = locate_failure(poses, covariance, seen);
  ASSERT_TRUE(before && after);
  EXPECT_EQ(after->from, before->from);
  EXPECT_EQ(after->to, before->to);
}

}  // namespace
}  // namespace tutti::estimation
