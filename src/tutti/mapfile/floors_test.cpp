// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/floors.hpp"

#include <gtest/gtest.h>

namespace tutti::mapfile {
namespace floors_test {

/// A chain of submaps of two keyframes each, of which it has the second from the next one, 10 s apart, along x.
struct Drive {
  ChainId chain;
  std::uint32_t component = 0, submaps = 0;
  double begin_s = 0.0;
};

struct Building {
  Content content;
  server::MapEstimate map;
};

Building building(const std::vector<Drive>& drives) {
  Building out;
  for (const Drive& drive : drives) {
    for (std::uint32_t k = 0; k <= drive.submaps; ++k)
      out.map.nodes.push_back({.id = {drive.chain, k},
                               .stamp = Timestamp{} + (drive.begin_s + 10.0 * k),
                               .representative = true,
                               .T_world_body = {Eigen::Quaterniond::Identity(), {1.0 * k, 0, 0}},
                               .component = drive.component});
    for (std::uint32_t k = 0; k < drive.submaps; ++k) {
      Submap submap{.id = {drive.chain, k}};
      for (const std::uint32_t of : {k, k + 1})
        submap.keyframes.push_back({.index = of,
                                    .stamp = Timestamp{} + (drive.begin_s + 10.0 * of),
                                    .T_odom_body = {Eigen::Quaterniond::Identity(), {1.0 * of, 0, 0}}});
      out.content.payload_sizes[submap.id] = {.points = 1000};
      out.content.submaps[submap.id] = std::make_shared<const Submap>(submap);
    }
  }
  std::ranges::sort(out.map.nodes, {}, &MapNode::id);
  return out;
}

const ChainId kAlpha{RobotId{0}, 0}, kAlphaLater{RobotId{0}, 1}, kBravo{RobotId{1}, 0}, kCharlie{RobotId{2}, 0};

TEST(Floors, TheLargestIsTheFirstAndWhatIsTooSmallIsNone) {
  const Building made = building({{kAlpha, 0, 4}, {kBravo, 1, 9}, {kCharlie, 2, 2}});
  const Floors floors = Floors::of(made.content, made.map);
  EXPECT_EQ(floors.count(), 2U);
  EXPECT_EQ(floors.of_component(1), 1U);
  EXPECT_EQ(floors.of_component(0), 2U);
  EXPECT_FALSE(floors.of_component(2).has_value());
}

TEST(Floors, ALiftIsWhereASessionEndsOnOneFloorAndTheNextBeginsOnAnother) {
  const Building made = building({{kAlpha, 0, 19, 0.0}, {kAlphaLater, 1, 4, 230.0}, {kBravo, 1, 4, 200.0}});
  const auto lifts = lifts_of(Floors::of(made.content, made.map), made.map);
  ASSERT_EQ(lifts.size(), 1U) << "another robot's session is none of it";
  EXPECT_EQ(lifts[0].from.floor, 1U);
  EXPECT_EQ(lifts[0].from.chain, kAlpha);
  EXPECT_DOUBLE_EQ(lifts[0].from.T_world_body.translation.x(), 19.0);
  EXPECT_EQ(lifts[0].to.floor, 2U);
  EXPECT_EQ(lifts[0].to.chain, kAlphaLater);
  EXPECT_DOUBLE_EQ(lifts[0].to.T_world_body.translation.x(), 0.0);
}

TEST(Floors, AnotherDayOrAClockThatBeganAnewTellsNothing) {
  for (const double begin_s : {90.0 + kLongestLift_s + 1.0, 20.0}) {
    const Building made = building({{kAlpha, 0, 9, 0.0}, {kAlphaLater, 1, 4, begin_s}});
    EXPECT_TRUE(lifts_of(Floors::of(made.content, made.map), made.map).empty()) << begin_s;
  }
}

}  // namespace floors_test
}  // namespace tutti::mapfile
