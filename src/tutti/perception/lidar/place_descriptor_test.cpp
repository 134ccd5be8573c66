// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/place_descriptor.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "support/perception/lidar/rooms.hpp"
#include "tutti/perception/lidar/candidates.hpp"

namespace tutti::lidar {
namespace place_descriptor_test {

using namespace test;

const LidarClosureConfig kConfig;

Submap seen_from(const World& world, const Walk& walk, int seed) {
  return make_submap({RobotId{0}, static_cast<std::uint32_t>(seed)}, world, walk, Rng(seed));
}

TEST(DescribePlace, isMostAlikeWhereverTheSubmapStandsAndHoweverItIsTurned) {
  const std::string place = describe_place(seen_from(furnished_room(), {}, 1), kConfig);
  ASSERT_TRUE(is_descriptor(place, kConfig));
  EXPECT_LE(place.size(), 4200u);
  const PlaceMatcher matcher(place);
  EXPECT_NEAR(matcher.likeness(place), 1.0, 0.01);
  const std::string elsewhere = describe_place(seen_from(other_room(), {}, 2), kConfig);
  ASSERT_FALSE(elsewhere.empty());
  const double unlike = matcher.likeness(elsewhere);
  Rng rng(3);
  for (int trial = 0; trial < 8; ++trial) {
    const Walk walk{.from = {rng.uniform(4, 10), rng.uniform(4, 6), rng.uniform(0.8, 1.8)},
                    .yaw_rad = rng.uniform(-std::numbers::pi, std::numbers::pi),
                    .tilt_rad = rng.uniform(-0.2, 0.2)};
    const std::string again = describe_place(seen_from(furnished_room(), walk, 10 + trial), kConfig);
    EXPECT_GT(matcher.likeness(again), unlike + 0.1) << trial;
    EXPECT_NEAR(PlaceMatcher(again).likeness(place), matcher.likeness(again), 1e-5);
  }
}

TEST(DescribePlace, agreesWithTheBestRoughAlignment) {
  const Submap a = seen_from(furnished_room(), {}, 1), b = seen_from(furnished_room(), {.yaw_rad = 2.0}, 2);
  const auto guesses = propose_alignments(extract_features(a, kConfig), extract_features(b, kConfig), kConfig);
  ASSERT_FALSE(guesses.empty());
  const double likeness = PlaceMatcher(describe_place(a, kConfig)).likeness(describe_place(b, kConfig));
  EXPECT_NEAR(likeness, guesses.front().score, 0.2);  // at half the resolution it is higher
  EXPECT_GE(likeness, guesses.front().score - 0.02);
}

TEST(DescribePlace, saysNothingOfASubmapThatIsNotUsable) {
  Submap empty = seen_from(furnished_room(), {}, 1);
  empty.cloud = nullptr;
  EXPECT_EQ(describe_place(empty, kConfig), "");
  EXPECT_FALSE(is_descriptor("", kConfig));
}

TEST(DescribePlace, isNotComparedWithOneOfOtherSettingsOrOtherBytes) {
  const std::string place = describe_place(seen_from(furnished_room(), {}, 1), kConfig);
  LidarClosureConfig coarser;
  coarser.candidates.cell_m = 1.6;
  EXPECT_FALSE(is_descriptor(place, coarser));
  EXPECT_FALSE(is_descriptor(place.substr(0, place.size() - 1), kConfig));
  EXPECT_FALSE(is_descriptor(place.substr(0, 9), kConfig));
  EXPECT_FALSE(is_descriptor("x" + place.substr(1), kConfig));
}

TEST(DescribePlace, isTheSameWheneverItIsComputed) {
  const Submap submap = seen_from(furnished_room(), {}, 1);
  EXPECT_EQ(describe_place(submap, kConfig), describe_place(submap, kConfig));
}

}  // namespace place_descriptor_test
}  // namespace tutti::lidar
