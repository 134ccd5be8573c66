// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace holding_test {

/// Robots with so many submaps of one keyframe each and the first of the next, and closures between them.
struct Scene {
  server::SubmapSet submaps;
  server::MapEstimate map;

  void add(std::uint32_t robot, std::uint32_t first, std::uint32_t count, std::uint32_t component = 0) {
    for (std::uint32_t i = first; i < first + count; ++i) {
      Submap submap{.id = {ChainId(RobotId{robot}), i}};
      submap.keyframes = {{.index = i}, {.index = i + 1}};
      submaps[submap.id] = std::make_shared<const Submap>(submap);
      MapNode node;
      node.id = {ChainId(RobotId{robot}), i};
      node.component = component;
      map.nodes.push_back(node);
    }
    std::ranges::sort(map.nodes, {}, &MapNode::id);
  }
  void close(std::uint32_t robot, std::uint32_t keyframe, std::uint32_t other, std::uint32_t other_keyframe,
             bool accepted = true) {
    map.closures.push_back(
        {.closure = {.from = {ChainId(RobotId{robot}), keyframe}, .to = {ChainId(RobotId{other}), other_keyframe}},
         .accepted = accepted});
  }
  [[nodiscard]] std::size_t of(std::uint32_t robot, std::uint32_t submap) const {
    const auto holding = closures_holding(submaps, map);
    const auto found = holding.find({ChainId(RobotId{robot}), submap});
    return found == holding.end() ? 1000 : found->second;
  }
};

TEST(ClosuresHolding, CountsPairsOfSubmapsNotClosures) {
  Scene scene;
  scene.add(0, 0, 10);
  scene.add(1, 0, 5);
  scene.close(0, 2, 1, 1);
  scene.close(0, 2, 1, 1);
  EXPECT_EQ(scene.of(1, 0), 1U);
  EXPECT_EQ(scene.of(0, 0), 1000U) << "the largest part holds by itself";
  scene.close(0, 8, 1, 4);
  EXPECT_EQ(scene.of(1, 4), 2U);
  scene.close(0, 9, 1, 3, false);
  EXPECT_EQ(scene.of(1, 4), 2U) << "a rejected one holds nothing";
}

TEST(ClosuresHolding, AChainHoldsAsItsWeakestStep) {
  Scene scene;
  scene.add(0, 0, 10);
  scene.add(1, 0, 5);
  scene.add(2, 0, 5);
  for (std::uint32_t i = 0; i < 3; ++i) scene.close(0, i, 1, i);
  scene.close(1, 4, 2, 4);
  EXPECT_EQ(scene.of(1, 0), 3U);
  EXPECT_EQ(scene.of(2, 0), 1U) << "through bravo by one";
  scene.close(0, 9, 2, 0);
  EXPECT_EQ(scene.of(2, 0), 2U) << "and by another one to alpha";
  EXPECT_EQ(scene.of(1, 0), 4U) << "which holds bravo, too";
}

TEST(ClosuresHolding, AGapInASessionMakesTwoParts) {
  Scene scene;
  scene.add(0, 0, 5);
  scene.add(0, 7, 2);
  scene.close(0, 1, 0, 7);
  EXPECT_EQ(scene.of(0, 8), 1U);
}

TEST(ClosuresHolding, EachComponentHasItsOwnRoot) {
  Scene scene;
  scene.add(0, 0, 3);
  scene.add(1, 0, 3, 1);
  scene.add(2, 0, 2, 1);
  scene.close(1, 0, 2, 0);
  EXPECT_EQ(scene.of(1, 0), 1000U);
  EXPECT_EQ(scene.of(2, 0), 1U);
  EXPECT_TRUE(closures_holding({}, {}).empty());
}

}  // namespace holding_test
}  // namespace tutti::page
