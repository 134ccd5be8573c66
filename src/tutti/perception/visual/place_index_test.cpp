// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/place_index.hpp"

#include <gtest/gtest.h>

#include "support/perception/visual/textured_room.hpp"

namespace tutti::visual {
namespace {

using namespace test;
const auto kCameras = stereo_cameras();

/// Thirty rooms, each a submap of another robot.
std::vector<std::vector<RoomPoint>> rooms() {
  std::vector<std::vector<RoomPoint>> out;
  for (std::uint64_t r = 0; r < 30; ++r) out.push_back(textured_room(300, Rng(r)));
  return out;
}
const auto kRooms = rooms();

PlaceIndex index_of_rooms() {
  PlaceIndex out(DescriptorKind::maplab, kWords, {.key_bits = 12});
  for (std::uint32_t r = 0; r < kRooms.size(); ++r) {
    const Seen seen = fly(kRooms[r], kCameras, {.turn_rad = 2.0, .keyframes = 5}, Rng(r));
    for (const KeyframeImages& keyframe : seen.images)
      out.add({RobotId{r}, 0}, {RobotId{r}, keyframe.keyframe}, keyframe.images[0].descriptors);
  }
  return out;
}
const PlaceIndex kIndex = index_of_rooms();

TEST(PlaceIndex, findsTheRoomAndTheKeyframeThatLookedThere) {
  EXPECT_EQ(kIndex.size(), 150U);
  for (std::uint32_t r = 0; r < kRooms.size(); ++r) {
    const Flight again{.from = {2.2, 2.1, 1.5}, .to = {5.1, 2.2, 1.4}, .turn_rad = 2.0, .keyframes = 5};
    const Seen seen = fly(kRooms[r], kCameras, again, Rng(r + 1000));
    for (const std::uint32_t k : {1U, 2U, 3U}) {
      const auto found = kIndex.query(seen.images[k].images[0].descriptors, 3);
      ASSERT_FALSE(found.empty());
      EXPECT_EQ(found[0].keyframe.chain.robot, RobotId{r});
      EXPECT_LE(std::abs(static_cast<int>(found[0].keyframe.index) - static_cast<int>(k)), 1);
      EXPECT_GE(found[0].votes, found.back().votes);
    }
  }
}

TEST(PlaceIndex, aNewRoomHasHardlyAnyVotes) {
  const Seen known = fly(kRooms[7], kCameras, {.turn_rad = 2.0, .keyframes = 5}, Rng(1)),
             strange = fly(textured_room(300, Rng(999)), kCameras, {.turn_rad = 2.0, .keyframes = 5}, Rng(1));
  const auto at_home = kIndex.query(known.images[2].images[0].descriptors, 1),
             abroad = kIndex.query(strange.images[2].images[0].descriptors, 1);
  EXPECT_LT(abroad.empty() ? 0.0 : abroad[0].votes, 0.1 * at_home.at(0).votes);
}

TEST(PlaceIndex, withoutDescriptorsThereIsNoAnswer) {
  EXPECT_TRUE(kIndex.query({}, 5).empty());
  EXPECT_TRUE(PlaceIndex(DescriptorKind::orb, 4).query({}, 5).empty());
  const Seen seen = fly(kRooms[0], kCameras, {}, Rng(1));
  EXPECT_THROW(static_cast<void>(PlaceIndex(DescriptorKind::orb, 4).query(seen.images[0].images[0].descriptors, 5)),
               std::logic_error);
}

}  // namespace
}  // namespace tutti::visual
