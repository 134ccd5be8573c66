// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/long_list.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/random_pose.hpp"
#include "tutti/base/random.hpp"

namespace tutti {
namespace long_list_test {

RelativePose any_step(Rng& rng) {
  RelativePose out{test::random_pose(rng), {}};
  Matrix6d root;
  for (double& x : root.reshaped()) x = rng.normal();
  out.covariance = root * root.transpose();
  out.covariance = (0.5 * (out.covariance + out.covariance.transpose())).eval();
  return out;
}

TEST(LongList, GivesBackWhatWasPutInToTheBit) {
  Rng rng(1);
  std::vector<RelativePose> steps;
  std::vector<Keyframe> keyframes;
  LongList<RelativePose> list;
  LongList<Keyframe> places;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    steps.push_back(any_step(rng));
    keyframes.push_back({i, Timestamp{17 * i}, steps.back().T_a_b, i % 3 == 0});
    list.push_back(steps.back());
    places.push_back(keyframes.back());
    ASSERT_EQ(list.size(), i + 1U);
    ASSERT_EQ(list.back(), steps.back());
  }
  EXPECT_EQ(list.all(), steps);
  EXPECT_EQ(places.all(), keyframes);
  EXPECT_EQ(list, LongList<RelativePose>(steps));
  EXPECT_EQ(list.front(), steps.front());
  EXPECT_EQ(list.part(255, 514), std::vector<RelativePose>(steps.begin() + 255, steps.begin() + 514));
  EXPECT_TRUE(list.part(1000, 1000).empty());
  EXPECT_THROW(static_cast<void>(list.part(0, 1001)), std::logic_error);
  list.set(700, steps[3]);
  EXPECT_EQ(list[700], steps[3]);
  EXPECT_NE(list, LongList<RelativePose>(steps));
}

TEST(LongList, IsARangeThatAlgorithmsTake) {
  LongList<Keyframe> list;
  for (std::uint32_t i = 0; i < 600; ++i) list.push_back({i, Timestamp{2 * i}, {}, i % 4 == 0});
  const auto at = std::ranges::lower_bound(list, Timestamp{801}, {}, &Keyframe::stamp);
  EXPECT_EQ((*at).index, 401U);
  EXPECT_EQ(at - list.begin(), 401);
  EXPECT_EQ(std::ranges::count_if(list, &Keyframe::representative), 150);
  EXPECT_EQ(std::ranges::lower_bound(list, Timestamp{2000}, {}, &Keyframe::stamp), list.end());
  std::uint32_t next = 0;
  for (const Keyframe& keyframe : list) EXPECT_EQ(keyframe.index, next++);
}

TEST(LongList, IsEmptyWhenItWasMovedOrCleared) {
  LongList<Pose3> list(std::vector<Pose3>(300));
  const LongList<Pose3> other = std::move(list);
  EXPECT_EQ(other.size(), 300U);
  EXPECT_TRUE(list.empty());  // NOLINT: as agents leave theirs
  EXPECT_EQ(list.size(), 0U);
  EXPECT_EQ(list.begin(), list.end());
  list = other;
  list.clear();
  EXPECT_TRUE(list.empty());
}

/// Odometry's covariances are; of others the part is kept that means something.
TEST(LongList, KeepsTheSymmetricPartOfACovariance) {
  RelativePose step{{}, Matrix6d::Identity()};
  step.covariance(0, 1) = 0.2;
  LongList<RelativePose> list;
  list.push_back(step);
  EXPECT_EQ(list[0].covariance(0, 1), 0.1);
  EXPECT_EQ(list[0].covariance(1, 0), 0.1);
}

}  // namespace long_list_test
}  // namespace tutti
