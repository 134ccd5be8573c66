// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/discontinuity.hpp"

#include <gtest/gtest.h>
// RapidCheck after gtest.
#include <rapidcheck/gtest.h>

#include "support/random_pose.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::evaluation {
namespace discontinuity_test {

/// `n` poses, `step_s` and 2 m apart along x.
Trajectory line(int n, double step_s) {
  Trajectory out;
  for (int i = 0; i < n; ++i)
    out.push_back({Timestamp{} + step_s * i, {Eigen::Quaterniond::Identity(), {2.0 * i, 0, 0}}});
  return out;
}

/// The tail of `trajectory` from pose `first` on, moved by `T`.
Trajectory moved_from(Trajectory trajectory, std::size_t first, const Pose3& T) {
  for (std::size_t i = first; i < trajectory.size(); ++i) trajectory[i].pose = T * trajectory[i].pose;
  return trajectory;
}

TEST(Discontinuity, AStepShowsAtItsPlaceWhateverComesLater) {
  const Trajectory raw = line(20, 0.5);
  const auto found = discontinuity(raw, moved_from(raw, 12, {Eigen::Quaterniond::Identity(), {0, 0.3, 0}}));
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->translation_m, 0.3, 1e-12);
  EXPECT_NEAR(found->rotation_deg, 0.0, 1e-6);
  EXPECT_EQ(found->translation_at, raw[10].stamp);  // the first pair of 1 s across the step
}

TEST(Discontinuity, ABendThatIsSpreadOutIsSmall) {
  const Trajectory raw = line(101, 0.5);
  Trajectory corrected = raw;  // 1 m sideways over 50 s
  for (std::size_t i = 0; i < corrected.size(); ++i) corrected[i].pose.translation.y() = 0.01 * static_cast<double>(i);
  EXPECT_NEAR(discontinuity(raw, corrected)->translation_m, 0.02, 1e-12);  // two steps of 0.5 s
  EXPECT_NEAR(discontinuity(raw, corrected, 5.0)->translation_m, 0.1, 1e-12);
}

TEST(Discontinuity, NeighboursCountEvenWhereNoPairIsASecondApart) {
  const Trajectory raw = line(5, 10.0);
  const Pose3 turn{so3_exp({0, 0, 0.1}), Eigen::Vector3d::Zero()};
  Trajectory corrected = raw;
  corrected[3].pose = raw[3].pose * turn;
  const auto found = discontinuity(raw, corrected);
  EXPECT_NEAR(found->rotation_deg, 0.1 / kRadPerDeg, 1e-9);
  EXPECT_EQ(found->rotation_at, raw[2].stamp);
  // Seen from the turned pose, the next one is 2 m away in another direction.
  EXPECT_NEAR(found->translation_m, 4.0 * std::sin(0.05), 1e-9);
}

TEST(Discontinuity, NeedsTwoCommonPoses) {
  EXPECT_FALSE(discontinuity({}, {}));
  EXPECT_FALSE(discontinuity(line(1, 1.0), line(5, 1.0)));
  Trajectory other = line(5, 1.0);
  for (auto& p : other) p.stamp = p.stamp + 0.01;
  EXPECT_FALSE(discontinuity(line(5, 1.0), other));
}

RC_GTEST_PROP(Discontinuity, DoesNotSeeRigidMotions, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint64_t>());
  Trajectory raw;
  for (int i = 0; i < 12; ++i) raw.push_back({Timestamp{} + 0.4 * i, test::random_pose(rng)});
  const auto found = discontinuity(raw, moved_from(raw, 0, test::random_pose(rng)));
  RC_ASSERT(found.has_value());
  RC_ASSERT(found->translation_m < 1e-9);
  RC_ASSERT(found->rotation_deg < 1e-5);
}

}  // namespace discontinuity_test
}  // namespace tutti::evaluation
