// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/alignment.hpp"

#include <gtest/gtest.h>
// gtest first
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "support/random_pose.hpp"

namespace tutti {
namespace alignment_test {

using test::pose_near;
using test::random_pose;
using Points = std::vector<Eigen::Vector3d>;

Points cloud(Rng& rng, std::size_t n, double sigma = 5.0) {
  Points points;
  while (points.size() < n) points.push_back(test::random_vector(rng, sigma));
  return points;
}

Points moved(const Pose3& T, Points points) {
  for (auto& p : points) p = T * p;
  return points;
}

double cost(const Pose3& T_a_b, const Points& a, const Points& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - T_a_b * b[i]).squaredNorm();
  return sum;
}

RC_GTEST_PROP(AlignPoints, RecoversATransform, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 T_a_b = random_pose(rng, 100.0);
  const Points b = cloud(rng, 3 + rng.index(20));
  RC_ASSERT(pose_near(align_points(moved(T_a_b, b), b), T_a_b, 1e-10));
}

RC_GTEST_PROP(AlignPoints, RecoversATransformFromAPlane, (std::uint64_t seed)) {
  Rng rng(seed);
  const Pose3 T_a_b = random_pose(rng, 100.0);
  Points b = cloud(rng, 20);
  for (auto& p : b) p.z() = 1.0;
  RC_ASSERT(pose_near(align_points(moved(T_a_b, b), b), T_a_b, 1e-10));
}

RC_GTEST_PROP(AlignPoints, NothingAlignsBetter, (std::uint64_t seed)) {
  Rng rng(seed);
  const Points b = cloud(rng, 12);
  Points a = moved(random_pose(rng), b);
  for (auto& p : a) p += test::random_vector(rng, rng.uniform(0.0, 5.0));
  if (seed % 3 == 0)
    for (auto& p : a) p.z() *= -1.0;  // a mirror image must not be answered with a mirror
  const Pose3 best = align_points(a, b);
  RC_ASSERT(is_valid(best, 1e-12));
  for (const double step : {1e-4, 1e-2, 1.0})
    for (int i = 0; i < 10; ++i)
      RC_ASSERT(cost(best, a, b) <= cost(retract(best, test::random_tangent(rng, step)), a, b) * (1.0 + 1e-12));
}

RC_GTEST_PROP(AlignPoints, FollowsAChangeOfEitherFrame, (std::uint64_t seed)) {
  Rng rng(seed);
  const Points b = cloud(rng, 10);
  Points a = moved(random_pose(rng), b);
  for (auto& p : a) p += test::random_vector(rng, 0.3);
  const Pose3 T_a_b = align_points(a, b);
  const Pose3 T_c = random_pose(rng);
  RC_ASSERT(pose_near(align_points(moved(T_c, a), b), T_c * T_a_b, 1e-9));
  RC_ASSERT(pose_near(align_points(a, moved(T_c, b)), T_a_b * T_c.inverse(), 1e-9));
}

TEST(AlignPoints, NoPointGivesIdentity) { EXPECT_EQ(align_points({}, {}), Pose3{}); }

TEST(AlignPoints, UnequalSizesAreOurBug) {
  const Points one(1);
  EXPECT_THROW(static_cast<void>(align_points(one, {})), std::logic_error);
}

RC_GTEST_PROP(AlignPoints, OnePointIsOnlyATranslation, (std::uint64_t seed)) {
  Rng rng(seed);
  const Points a = cloud(rng, 1, 1e6);
  const Points b = cloud(rng, 1, 1e6);
  const Pose3 T_a_b = align_points(a, b);
  RC_ASSERT(pose_near(T_a_b, {Eigen::Quaterniond::Identity(), a[0] - b[0]}, 1e-9));
  // The same point seen many times: its mean is off by rounding, which is no reason to turn.
  const Pose3 repeated = align_points(Points(7, a[0]), Points(7, b[0]));
  RC_ASSERT(pose_near(repeated, T_a_b, 1e-8));
}

RC_GTEST_PROP(AlignPoints, ALineIsTurnedByTheSmallerAngle, (std::uint64_t seed)) {
  Rng rng(seed);
  const Eigen::Vector3d direction_a = test::random_direction(rng);
  const Eigen::Vector3d direction_b = test::random_direction(rng);
  const Eigen::Vector3d offset = test::random_vector(rng, 1000.0);
  Points a;
  Points b;
  for (std::uint64_t i = 0; i < 2 + seed % 5; ++i) {
    const double s = static_cast<double>(i) + rng.uniform(0.0, 0.5);
    a.push_back(offset + s * direction_a);
    b.push_back(s * direction_b);
  }
  const Pose3 T_a_b = align_points(a, b);
  RC_ASSERT(std::sqrt(cost(T_a_b, a, b)) < 1e-9);
  const double between = std::atan2(direction_a.cross(direction_b).norm(), direction_a.dot(direction_b));
  RC_ASSERT(std::abs(rotation_angle(T_a_b) - between) < 1e-8);
}

TEST(AlignPoints, OppositeLinesTurnByPi) {
  const Points a{{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}};
  const Points b{{1.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
  const Pose3 T_a_b = align_points(a, b);
  EXPECT_NEAR(rotation_angle(T_a_b), std::numbers::pi, 1e-12);
  EXPECT_LT(cost(T_a_b, a, b), 1e-24);
}

}  // namespace alignment_test
}  // namespace tutti
