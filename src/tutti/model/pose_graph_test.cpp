// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/pose_graph.hpp"

#include <gtest/gtest.h>

namespace tutti {
namespace pose_graph_test {

TEST(PoseGraph, EveryLoopAndNoTreeHasDegreesOfFreedom) {
  EXPECT_EQ(degrees_of_freedom({}), 0U);
  PoseGraph graph{.poses = std::vector<Pose3>(6), .edges = {}};
  EXPECT_EQ(components(graph).second, 6);
  graph.edges = {{.from = 4, .to = 1}, {.from = 1, .to = 2}, {.from = 5, .to = 3}};
  EXPECT_EQ(components(graph), std::pair(std::vector<int>({0, 1, 1, 2, 1, 2}), 3));
  EXPECT_EQ(degrees_of_freedom(graph), 0U);
  graph.edges.push_back({.from = 2, .to = 4});  // closes a loop
  EXPECT_EQ(degrees_of_freedom(graph), 6U);
  graph.edges.push_back({.from = 0, .to = 3});  // joins two parts
  EXPECT_EQ(degrees_of_freedom(graph), 6U);
  graph.edges.push_back({.from = 1, .to = 2});  // measured twice
  EXPECT_EQ(degrees_of_freedom(graph), 12U);
}

}  // namespace pose_graph_test
}  // namespace tutti
