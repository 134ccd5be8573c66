// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/grids/changes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "tutti/base/random.hpp"

namespace tutti::grids {
namespace changes_test {

using Eigen::Vector3d;

/// A box that stands on the ground.
struct Box {
  Vector3d middle, size;
  [[nodiscard]] bool has(const Vector3d& p) const { return ((p - middle).array().abs() <= 0.5 * size.array()).all(); }
};

/// A submap of a robot that drives from -3 to 3 along x in a hall of 12 x 8 x 3 m: each ray ends at the first box or
/// wall. Positions have an error of 3 cm.
LevelSubmap drive(const std::vector<Box>& boxes, std::uint64_t seed, double from_x = -3.0) {
  LevelSubmap out;
  Rng rng(seed);
  for (int i = 0; i <= 12; ++i)
    out.keyframes.push_back({Timestamp{i}, {Eigen::Quaterniond::Identity(), {from_x + 0.5 * i, 0.0, 0.6}}});
  for (const StampedPose& keyframe : out.keyframes)
    for (int azimuth = 0; azimuth < 180; ++azimuth)
      for (int beam = -8; beam <= 8; ++beam) {
        const double yaw = 2.0 * M_PI * azimuth / 180.0, pitch = 0.06 * beam;
        const Vector3d ray(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
        Vector3d at = keyframe.pose.translation;
        const auto is_outside = [](const Vector3d& p) {
          return std::abs(p.x()) > 6.0 || std::abs(p.y()) > 4.0 || p.z() < 0.0 || p.z() > 3.0;
        };
        while (!is_outside(at) && std::ranges::none_of(boxes, [&](const Box& box) { return box.has(at); }))
          at += 0.02 * ray;
        const Vector3d error(rng.normal(0.03), rng.normal(0.03), rng.normal(0.03));
        out.points.push_back((at + error).cast<float>());
      }
  return out;
}

SeenSpace seen(const std::vector<Box>& boxes, std::uint64_t seed) {
  SeenSpace out({});
  for (std::uint64_t k = 0; k < 3; ++k) out.add(drive(boxes, 10 * seed + k));
  return out;
}

const Box kCrate{{1.5, 2.0, 0.5}, {1.0, 1.0, 1.0}}, kShelf{{-2.0, -2.5, 1.0}, {2.0, 0.5, 2.0}};

TEST(Changes, AreNoneWhereNothingChanged) {
  const Changes changes = find_changes(seen({kShelf}, 1), seen({kShelf}, 2));
  EXPECT_TRUE(changes.things.empty());
  EXPECT_GT(changes.same, 1000U);
  EXPECT_LT(changes.unsure.size(), 5U);
}

TEST(Changes, WhatWasBroughtAndWhatWasTakenAwayHaveTheirPlaces) {
  const SeenSpace before = seen({kShelf}, 1), now = seen({kCrate}, 2);
  const Changes changes = find_changes(before, now);
  ASSERT_EQ(changes.things.size(), 2U);
  for (const ChangedThing& thing : changes.things) {
    const Box& box = thing.appeared ? kCrate : kShelf;
    EXPECT_LT((thing.centre - box.middle).head<2>().norm(), 0.6) << thing.centre.transpose();
    EXPECT_TRUE(((thing.size - box.size).array().abs() < 0.8).all()) << thing.size.transpose();
  }
  EXPECT_NE(changes.things.front().appeared, changes.things.back().appeared);
  const Changes back = find_changes(now, before);
  EXPECT_EQ(back.appeared.size(), changes.gone.size());
  EXPECT_EQ(back.gone.size(), changes.appeared.size());
}

/// Ground that is new is no change.
TEST(Changes, AreNotSaidWhereNobodyLookedTheOtherTime) {
  LevelSubmap half = drive({}, 1);
  std::erase_if(half.points, [](const Eigen::Vector3f& p) { return p.x() > 0.0F; });
  SeenSpace before({});
  before.add(half);
  const Changes changes = find_changes(before, seen({kCrate}, 2));
  EXPECT_TRUE(changes.things.empty());
  EXPECT_GT(changes.unseen_before, 300U);
}

/// Somebody who walks by is in one submap of three.
TEST(Changes, WhoWalksByIsNothing) {
  SeenSpace before = seen({}, 1);
  SeenSpace now({});
  now.add(drive({kCrate}, 7));
  for (std::uint64_t k = 0; k < 3; ++k) now.add(drive({}, 20 + k));
  EXPECT_TRUE(find_changes(before, now).things.empty());
}

TEST(Changes, ARobotBesideIsNothing) {
  LevelSubmap beside = drive({kCrate}, 3);
  for (double x = 1.0; x <= 2.01; x += 0.25)
    for (double y = 1.5; y <= 2.51; y += 0.25)
      for (double z = 0.0; z <= 1.01; z += 0.25) beside.mates.emplace_back(x, y, z);
  SeenSpace now({});
  now.add(beside);
  EXPECT_TRUE(find_changes(seen({}, 1), now).things.empty());
}

}  // namespace changes_test
}  // namespace tutti::grids
