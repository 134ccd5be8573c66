// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/evaluation/keyframe_trajectory.hpp"

#include <gtest/gtest.h>

namespace tutti::evaluation {
namespace keyframe_trajectory_test {

/// A pose a second, each a metre on.
Trajectory line(int first, int last, int step = 1) {
  Trajectory out;
  for (int i = first; i <= last; i += step)
    out.push_back({Timestamp{} + 1.0 * i, {Eigen::Quaterniond::Identity(), {1.0 * i, 0, 0}}});
  return out;
}

TEST(KeyframeTrajectory, KeyframesTogetherStandForTheWholeDistance) {
  const Trajectory trajectory = line(0, 100);
  for (const Trajectory& keyframes : {trajectory, line(3, 93, 10), line(40, 40)})
    EXPECT_DOUBLE_EQ(KeyframeTrajectory(trajectory, keyframes).part_m(keyframes), 100.0);
}

TEST(KeyframeTrajectory, ASegmentStandsForItsDistanceToHalfwayBeyond) {
  const KeyframeTrajectory trajectory(line(0, 100), line(0, 100, 10));
  EXPECT_DOUBLE_EQ(trajectory.part_m(line(30, 50, 10)), 30.0);
  EXPECT_DOUBLE_EQ(trajectory.part_m(line(90, 100, 10)), 15.0);
  EXPECT_DOUBLE_EQ(trajectory.part_m(line(0, 20, 20)), 15.0);    // without the one between them
  EXPECT_DOUBLE_EQ(trajectory.part_m(line(35, 65, 10)), 0.0);    // no keyframes
  EXPECT_DOUBLE_EQ(trajectory.part_m(line(30, 140, 10)), 75.0);  // and more than there are
}

TEST(KeyframeTrajectory, StandingStillCountsNothing) {
  Trajectory trajectory = line(0, 50);
  for (int i = 0; i < 50; ++i) trajectory.push_back({Timestamp{} + 51.0 + i, trajectory.back().pose});
  const KeyframeTrajectory shared(trajectory, trajectory);
  EXPECT_DOUBLE_EQ(shared.part_m(line(0, 50)), 50.0);
  EXPECT_DOUBLE_EQ(shared.part_m(line(51, 100)), 0.0);
}

TEST(KeyframeTrajectory, NothingToShareOut) {
  EXPECT_EQ(KeyframeTrajectory({}, line(0, 5)).part_m(line(0, 5)), 0.0);
  EXPECT_EQ(KeyframeTrajectory(line(0, 5), {}).part_m(line(0, 5)), 0.0);
  EXPECT_EQ(KeyframeTrajectory(line(0, 5), {}).whole_m(), 5.0);
}

}  // namespace keyframe_trajectory_test
}  // namespace tutti::evaluation
