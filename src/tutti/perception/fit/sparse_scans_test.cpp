// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/sparse_scans.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "support/perception/lidar/rooms.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::fit {
namespace sparse_scans_test {

/// A drive through a room, or along a corridor, of scans with 200 points.
std::vector<lidar::PosedCloud> drive(const lidar::test::World& world, const Eigen::Vector3d& from,
                                     const Eigen::Vector3d& to, bool is_in_world) {
  constexpr std::size_t kScans = 30, kPoints = 200;
  std::vector<lidar::PosedCloud> out;
  Pose3 T_world_submap;
  for (std::size_t s = 0; s < kScans; ++s) {
    const double share = static_cast<double>(s) / (kScans - 1), yaw = 0.4 * std::sin(3.0 * share);
    const Pose3 T{so3_exp({0, 0, yaw}), from + share * (to - from)};
    if (s == 0) T_world_submap = T;
    const PointCloud all = lidar::test::observe(
        world, {.from = T.translation, .to = T.translation, .yaw_rad = yaw, .keyframes = 1}, Rng(s));
    auto cloud = std::make_shared<PointCloud>();
    Rng rng(1000 + s);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const Eigen::Vector3f p = all.points[rng.index(all.points.size())];
      cloud->points.push_back(is_in_world ? (T * p.cast<double>()).cast<float>() : p);
    }
    out.push_back({Timestamp{} + (1.0 + static_cast<double>(s)), T_world_submap.inverse() * T, cloud});
  }
  return out;
}

TEST(SparseScans, ThoseThatAreInTheWorldAreFoundByWhatTheyHaveInCommon) {
  const auto room = lidar::test::furnished_room();
  EXPECT_NEAR(moved_while_still(drive(room, {3, 4, 1.2}, {8, 5, 1.2}, true)), 5.1, 0.2);
}

TEST(SparseScans, NothingIsSaidOfHonestOnesOrOfARobotThatStands) {
  const auto room = lidar::test::furnished_room(), corridor = lidar::test::corridor();
  EXPECT_EQ(moved_while_still(drive(room, {3, 4, 1.2}, {8, 5, 1.2}, false)), 0.0);
  EXPECT_EQ(moved_while_still(drive(corridor, {30, 1.3, 1.2}, {42, 1.3, 1.2}, false)), 0.0);
  EXPECT_EQ(moved_while_still(drive(room, {5, 4, 1.2}, {6, 4, 1.2}, true)), 0.0);
  EXPECT_EQ(moved_while_still({}), 0.0);
}

}  // namespace sparse_scans_test
}  // namespace tutti::fit
