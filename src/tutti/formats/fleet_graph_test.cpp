// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/formats/fleet_graph.hpp"

#include <gtest/gtest.h>

#include "tutti/formats/graph_stamps.hpp"

namespace tutti::formats {
namespace fleet_graph_test {

PoseGraphEdge edge(std::size_t from, std::size_t to, double x_m) {
  return {from, to, {Eigen::Quaterniond::Identity(), {x_m, 0.0, 0.0}}, 4.0 * Matrix6d::Identity()};
}

std::int64_t key(char letter, std::int64_t number) { return (std::int64_t{letter} << 56) + number; }

/// Two robots of three poses each, of which one has every fifth number.
G2oFile two_robots() {
  G2oFile out{.vertex_ids = {key('a', 0), key('a', 1), key('a', 2), key('c', 0), key('c', 5), key('c', 10)}};
  out.graph.poses.resize(6);
  out.graph.edges = {edge(0, 1, 1.0), edge(1, 2, 1.0), edge(3, 4, 2.0), edge(4, 5, 2.0), edge(5, 1, 0.5)};
  return out;
}

TEST(FleetGraph, SymbolKeysAreRobotsAndTheNthPoseIsAtNSeconds) {
  const std::string path = testing::TempDir() + "tutti_fleet_graph_test.g2o";
  ASSERT_TRUE(write_g2o(path, two_robots()));
  const auto fleet = read_fleet_graph(path);
  ASSERT_TRUE(fleet) << fleet.error().message;
  ASSERT_EQ(fleet->vertices.size(), 6U);
  EXPECT_EQ(to_string(fleet->vertices[2].name), "a2");
  EXPECT_EQ(to_string(fleet->vertices[5].name), "c2");
  EXPECT_EQ(fleet->vertices[5].stamp.ns, 2'000'000'000);
  EXPECT_FALSE(fleet->vertices[5].pose);
  EXPECT_TRUE(is_odometry(fleet->vertices[3].name, fleet->vertices[4].name));
  EXPECT_EQ(fleet->edges[4].stamp.ns, 2'000'000'000);
  EXPECT_NEAR(fleet->edges[4].measurement.covariance(3, 3), 0.25, 1e-12);
  EXPECT_EQ(times_of(*fleet)->from, "none in the file: the n-th pose of a robot counts as at n seconds");

  std::vector<VertexStamp> stamps;
  for (const std::int64_t id : two_robots().vertex_ids) stamps.push_back({id, {}, Timestamp{id & 15} + 3.0});
  for (std::size_t k = 0; k < 6; ++k) stamps[k].stamp = stamps[k].stamp + 0.5 * static_cast<double>(k);
  ASSERT_TRUE(write_graph_stamps(stamps_beside(path), stamps));
  EXPECT_EQ(read_fleet_graph(path)->vertices[5].stamp, stamps[5].stamp);
  stamps.pop_back();
  ASSERT_TRUE(write_graph_stamps(stamps_beside(path), stamps));
  EXPECT_NE(read_fleet_graph(path).error().message.find("has no line for vertex c10"), std::string::npos);
  std::remove(stamps_beside(path).c_str());
}

TEST(FleetGraph, PlainNumbersAreRobotsWhereOdometryHasGaps) {
  G2oFile graph = two_robots();
  graph.vertex_ids = {0, 1, 2, 3, 4, 5};
  const auto fleet = as_fleet(graph, "g");
  ASSERT_TRUE(fleet) << fleet.error().message;
  EXPECT_EQ(to_string(fleet->vertices[2].name), "a2");
  EXPECT_EQ(to_string(fleet->vertices[3].name), "b0");
  graph.vertex_ids.clear();
  for (std::int64_t id = 0; id < 30; ++id) graph.vertex_ids.push_back(2 * id);
  graph.graph.poses.resize(30);
  graph.graph.edges.clear();
  EXPECT_FALSE(as_fleet(graph, "g"));
}

TEST(FleetGraph, WhatIsUndeterminedIsUncertain) {
  G2oFile graph = two_robots();
  graph.graph.edges[0].information(5, 5) = 0.0;
  const auto fleet = as_fleet(graph, "g");
  ASSERT_TRUE(fleet);
  EXPECT_GT(fleet->edges[0].measurement.covariance(5, 5), 1e6);
  EXPECT_TRUE(fleet->edges[0].measurement.covariance.allFinite());
}

}  // namespace fleet_graph_test
}  // namespace tutti::formats
