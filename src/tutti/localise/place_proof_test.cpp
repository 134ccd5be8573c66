// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/place_proof.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "support/localise/tunnel.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/lidar/undistort.hpp"

namespace tutti::localise {
namespace place_proof_test {

StampedPose at(double stamp_s, double x_m) {
  return {Timestamp{} + stamp_s, {Eigen::Quaterniond::Identity(), {x_m, 0.0, 0.0}}};
}

TEST(Stretch, KeepsFewScansAndNoneThatIsOld) {
  Stretch stretch;
  for (int k = 0; k < 400; ++k) {  // at 10 Hz, standing at first, then at 20 m/s
    const StampedPose now = at(0.1 * k, k < 200 ? 0.0 : 2.0 * (k - 200));
    if (stretch.wants(now)) stretch.add({now, {}});
    ASSERT_FALSE(stretch.scans().empty());
    ASSERT_LE(stretch.scans().size(), Stretch::kMost);
    ASSERT_LE(now.stamp - stretch.scans().front().at.stamp, Stretch::kLength_s + Stretch::kStep_s);
    if (k == 199) {
      EXPECT_GE(stretch.scans().size(), Stretch::kLeast);
    }
  }
  EXPECT_LE(stretch.scans().back().at.stamp - stretch.scans().front().at.stamp, 2.0);  // 20 m of driving
  stretch.clear();
  EXPECT_TRUE(stretch.wants(at(100.0, 0.0)));
}

/// The scans that a robot has kept when it is at sample `to`.
Stretch stretch_of(const Recording& robot, std::size_t from, std::size_t to) {
  Stretch stretch;
  for (std::size_t k = from; k < to; ++k) {
    const StampedPose& now = robot.odometry[k];
    if (!stretch.wants(now)) continue;
    const auto scan = robot.scans->scan(k).value();
    const auto cloud = lidar::undistort(*scan, robot.odometry);
    EXPECT_TRUE(cloud.has_value());
    stretch.add({now, fit::make_fit_scan(now.stamp, *cloud->cloud, 0.5)});
  }
  EXPECT_GE(stretch.scans().size(), Stretch::kLeast);
  return stretch;
}

/// A place half a metre and some degrees from where the robot was is shown; where it was not, or looking another way,
/// it is not, although it was found first.
TEST(PlaceProof, ScansShowTheRightPlaceAndNoOther) {
  const test::World world = test::make_world(3);
  const Recording& robot = world.robots[2];
  LocalMaps maps(world.map, {});
  std::size_t shown = 0, registered = 0, most = 0;
  for (const std::size_t from : {50, 200, 350}) {
    const Stretch stretch = stretch_of(robot, from, from + 50);
    const auto place = [&](const Pose3& T_true_found, std::size_t of) {
      return Hypothesis{.T_world_body = {robot.reference[of].pose * T_true_found, Matrix6d::Identity()},
                        .at = robot.odometry[from + 25],
                        .quality = 0.9};
    };
    const Pose3 near{so3_exp({0.0, 0.0, 3.0 * kRadPerDeg}), {0.4, -0.3, 0.05}};
    const Pose3 about{so3_exp({0.0, 0.0, std::numbers::pi}), {0.0, 0.0, 0.0}};
    Hypothesis right = place(near, from + 25);
    right.quality = 0.3;
    const auto proven =
        all_proven(maps, stretch.scans(), {place(about, from + 25), place({}, from + 150), right}, registered);
    most += 15 * stretch.scans().size();  // the three, three turns, and nine beside the best
    ASSERT_FALSE(proven.empty());
    const Hypothesis& best = proven.front();
    EXPECT_EQ(best.at, stretch.scans().back().at);
    const auto newest = std::ranges::find(robot.odometry, best.at.stamp, &StampedPose::stamp) - robot.odometry.begin();
    const Pose3& truth = robot.reference[static_cast<std::size_t>(newest)].pose;
    EXPECT_LT((best.T_world_body.T_a_b.translation - truth.translation).norm(), 0.2);
    EXPECT_LT(rotation_angle(best.T_world_body.T_a_b.inverse() * truth), 1.5 * kRadPerDeg);
    shown += best.shown == Shown::surely ? 1 : 0;
    for (std::size_t k = 1; k < proven.size(); ++k) EXPECT_LT(proven[k].quality, kRival * best.quality);
  }
  EXPECT_EQ(shown, 3U);
  EXPECT_LT(5 * registered, 4 * most);  // what cannot be a rival any more is given up
}

/// A robot drives in tunnels that nobody has mapped and that look like the mapped ones. Scans may fit there closely
/// enough to show a place, but then they fit nearly as well some metres on, or the other way round.
TEST(PlaceProof, InALookAlikeTunnelThatNobodyHasMappedNoPlaceStandsAlone) {
  const test::World mapped = test::make_world(3, 1.0), other = test::make_world(4, 1.0);
  LocalMaps maps(mapped.map, {});
  const Recording &robot = other.robots[2], &mapper = mapped.robots[0];
  std::size_t registered = 0;
  int shown = 0, alone = 0;
  for (std::size_t from = 25; from + 50 < robot.odometry.size(); from += 25) {
    const Stretch stretch = stretch_of(robot, from, from + 50);
    for (std::size_t k = 25; k < mapper.reference.size(); k += 50) {
      const Hypothesis there{.T_world_body = {mapper.reference[k].pose, Matrix6d::Identity()},
                             .at = robot.odometry[from + 25],
                             .quality = 0.9};
      const SearchResult found{all_proven(maps, stretch.scans(), {there}, registered)};
      if (found.places.empty() || found.places.front().shown != Shown::surely) continue;
      ++shown;
      alone += found.rivals().empty() ? 1 : 0;
    }
  }
  EXPECT_GE(shown, 10);
  EXPECT_EQ(alone, 0) << "8 of 11 before places beside the best were asked, 1 of 22 where half as good ones were none";
}

}  // namespace place_proof_test
}  // namespace tutti::localise
