// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/place_descriptor.hpp"

#include <gtest/gtest.h>

#include "support/perception/visual/textured_room.hpp"

namespace tutti::visual {
namespace place_descriptor_test {

using namespace test;

const VisualClosureConfig kConfig;

constexpr std::size_t kMostBytes = 3 + 2 * 512 * kWords * 8;

Submap seen_from(const std::vector<RoomPoint>& room, const Flight& flight, std::uint32_t number) {
  return make_submap({RobotId{number}, 0}, fly(room, stereo_cameras(), flight, Rng(number)), stereo_cameras(), {});
}

std::string place_of(const std::vector<RoomPoint>& room, const Flight& flight, std::uint32_t number) {
  return describe_place(seen_from(room, flight, number), kConfig);
}

/// The same wall from nearer and the opposite direction.
const Flight kBack{.from = {4.6, 2.6, 1.5}, .to = {2.4, 2.4, 1.4}, .yaw_rad = 1.7, .keyframes = 8};
/// The wall behind.
const Flight kBehind{.yaw_rad = -1.5, .turn_rad = 0.0};

TEST(DescribeVisualPlace, isMostAlikeWhereTheSameWallIsSeen) {
  const auto room = textured_room(700, Rng(1));
  const std::string place = place_of(room, {}, 1), back = place_of(room, kBack, 2);
  const std::string behind = place_of(room, kBehind, 3), elsewhere = place_of(textured_room(700, Rng(2)), {}, 4);
  for (const std::string& one : {place, back, behind, elsewhere}) {
    ASSERT_TRUE(is_descriptor(one));
    EXPECT_LE(one.size(), kMostBytes);
  }
  const PlaceMatcher matcher(place, kConfig);
  const double whole = matcher.likeness(place);
  EXPECT_EQ(whole, 2.0 * static_cast<double>(place.size() / (kWords * 8)));
  EXPECT_GT(matcher.likeness(back), 0.2 * whole);
  EXPECT_LT(matcher.likeness(behind), 0.1 * whole);
  EXPECT_LT(matcher.likeness(elsewhere), 0.01 * whole);
}

TEST(DescribeVisualPlace, isAsAlikeWhicheverOfTwoIsAsked) {
  const auto room = textured_room(700, Rng(3));
  std::vector<std::string> places;
  for (std::uint32_t i = 0; i < 5; ++i)
    places.push_back(place_of(room, {.yaw_rad = 1.5 + 0.4 * i, .keyframes = 6 + i}, i + 1));
  for (const std::string& a : places)
    for (const std::string& b : places)
      EXPECT_EQ(PlaceMatcher(a, kConfig).likeness(b), PlaceMatcher(b, kConfig).likeness(a));
}

TEST(DescribeVisualPlace, keepsTheLandmarksThatMostKeyframesSaw) {
  Submap submap = seen_from(textured_room(3000, Rng(5)), {}, 1);
  const std::string place = describe_place(submap, kConfig);
  ASSERT_EQ(place.size(), kMostBytes) << "more landmarks than are kept";
  const std::size_t landmarks = submap.visual->landmarks.size(), few = landmarks - 10;
  ASSERT_GT(few, 512U);
  // Seen by one keyframe alone, the last ten are left out for others.
  VisualPayload fewer = *submap.visual;
  for (VisualFrame& frame : fewer.frames)
    if (frame.keyframe != fewer.frames.front().keyframe)
      std::erase_if(frame.observations, [&](const Observation& o) { return o.landmark >= few; });
  submap.visual = std::make_shared<const VisualPayload>(fewer);
  const std::string without = describe_place(submap, kConfig);
  const auto has = [&](std::uint32_t row) {
    const auto bits = fewer.descriptors.row(row);
    return without.find(std::string(reinterpret_cast<const char*>(bits.data()), bits.size_bytes())) !=
           std::string::npos;
  };
  for (const Observation& o : fewer.frames.front().observations)
    EXPECT_FALSE(o.landmark != kNoIndex && o.landmark >= few && o.descriptor != kNoIndex && has(o.descriptor))
        << o.landmark;
}

TEST(DescribeVisualPlace, saysNothingOfASubmapWithFewLandmarks) {
  Submap submap = seen_from(textured_room(20, Rng(1)), {}, 1);
  EXPECT_EQ(describe_place(submap, kConfig), "");
  submap.visual = nullptr;
  EXPECT_EQ(describe_place(submap, kConfig), "");
  EXPECT_FALSE(is_descriptor(""));
}

TEST(DescribeVisualPlace, isNotReadFromOtherBytes) {
  const std::string place = place_of(textured_room(700, Rng(1)), {}, 1);
  for (std::size_t size : {std::size_t{1}, std::size_t{3}, place.size() - 1})
    EXPECT_FALSE(is_descriptor(place.substr(0, size)));
  EXPECT_FALSE(is_descriptor(place + "x"));
  std::string other = place;
  other[0] = 1;  // as a LiDAR place begins
  EXPECT_FALSE(is_descriptor(other));
  other = place;
  other[1] = static_cast<char>(DescriptorKind::orb);
  ASSERT_TRUE(is_descriptor(other));
  EXPECT_EQ(PlaceMatcher(place, kConfig).likeness(other), 0.0);
  other = place;
  other[2] = 0;
  EXPECT_FALSE(is_descriptor(other));
}

}  // namespace place_descriptor_test
}  // namespace tutti::visual
