// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/place_search.hpp"

#include <gtest/gtest.h>

#include "support/localise/tunnel.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::localise {
namespace place_search_test {

const test::World& tunnel() {
  static const test::World world = test::make_world(3);
  return world;
}

/// The robot's submaps, of a chain that the map does not have.
std::vector<Submap> submaps_of(const Recording& robot, const KnownMap& map) {
  robot::SubmapConfig config;
  config.fit.scans = "off";
  config.has_scans = true;
  robot::SubmapBuilder builder(ChainId(map.free_robot()), config);
  test::feed(robot, robot.odometry, 0, robot.odometry.size(), builder);
  std::vector<Submap> out;
  while (auto submap = builder.take_submap()) out.push_back(std::move(*submap));
  return out;
}

/// Robots of one kind see the same: submaps of another robot are found where it drove, and those of the map's features
/// that are asked for twice are computed once.
TEST(PlaceSearch, CloudsShowRoughlyWhereARobotIs) {
  const test::World& world = tunnel();
  const Recording& robot = world.robots[2];
  const auto verifier = test::verifier();
  LocalMaps maps(world.map, {});
  std::size_t found = 0, asked = 0;
  for (const Submap& own : submaps_of(robot, *world.map)) {
    const auto candidates = most_alike(*world.map, *verifier, own, 12);
    const auto rough = rough_places(*world.map, maps, own, candidates);
    ASSERT_TRUE(rough.has_value()) << rough.error().message;
    EXPECT_EQ(rough->compared, candidates.size());
    ++asked;
    found += std::ranges::any_of(rough->places, [&](const Hypothesis& place) {
      EXPECT_EQ(place.shown, Shown::no);
      EXPECT_GE(place.quality, 0.0);
      EXPECT_LE(place.quality, 1.0);
      const auto k = std::ranges::find(robot.odometry, place.at.stamp, &StampedPose::stamp) - robot.odometry.begin();
      const Pose3 error = robot.reference[static_cast<std::size_t>(k)].pose.inverse() * place.T_world_body.T_a_b;
      return error.translation.norm() < 1.0 && rotation_angle(error) < 6.0 * kRadPerDeg;
    });
  }
  EXPECT_GE(asked, 8U);
  EXPECT_GE(found + 1, asked);
  EXPECT_LE(maps.extracted(), world.map->submaps.size());
}

TEST(PlaceSearch, ACloudThatCannotBeReadIsSaid) {
  class Damaged final : public server::PayloadStore {
    Status put(const Submap&) override { return {}; }
    [[nodiscard]] Result<std::shared_ptr<const PointCloud>> cloud(SubmapId) const override {
      return fail(ErrorCode::parse, "damaged");
    }
    [[nodiscard]] Result<std::shared_ptr<const VisualPayload>> visual(SubmapId) const override { return nullptr; }
  };
  const test::World& world = tunnel();
  KnownMap damaged = *world.map;
  damaged.payloads = std::make_shared<const Damaged>();
  const auto map = std::make_shared<const KnownMap>(std::move(damaged));
  LocalMaps maps(map, {});
  const Submap own = submaps_of(world.robots[2], *map).front();
  EXPECT_FALSE(rough_places(*map, maps, own, std::vector<SubmapId>(1, map->submaps.begin()->first)).has_value());
  EXPECT_EQ(maps.about({1, map->submaps.begin()->second.middle}), nullptr);
}

}  // namespace place_search_test
}  // namespace tutti::localise
