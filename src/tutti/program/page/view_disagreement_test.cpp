// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/mapfile/small_map.hpp"
#include "tutti/program/page/view.hpp"

namespace tutti::page {
namespace view_disagreement_test {

const ChainId kChain(RobotId{0}, 5);

/// Straight ahead, a keyframe each metre, every second one representative; steps of one covariance.
server::SubmapSet straight(std::uint32_t submaps, std::uint32_t steps, double variance) {
  server::SubmapSet out;
  for (std::uint32_t i = 0; i < submaps; ++i) {
    Submap submap{.id = {kChain, i}};
    for (std::uint32_t k = 0; k <= steps; ++k) {
      const std::uint32_t index = i * steps + k;
      submap.keyframes.push_back({.index = index,
                                  .stamp = Timestamp{} + static_cast<double>(index),
                                  .T_odom_body = {Eigen::Quaterniond::Identity(), {1.0 * index, 0.0, 0.0}},
                                  .representative = index % 2 == 0});
      if (k > 0)
        submap.odometry.push_back({{Eigen::Quaterniond::Identity(), {1.0, 0.0, 0.0}}, variance * Matrix6d::Identity()});
    }
    out[submap.id] = std::make_shared<const Submap>(submap);
  }
  return out;
}

TEST(RobotNodes, AreJoinedByTheirOdometryAndNoMore) {
  const auto nodes = robot_nodes(straight(3, 5, 1e-4), kChain);
  ASSERT_EQ(nodes.size(), 8U) << "keyframes that two submaps share count once";
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    EXPECT_EQ(nodes[i].stamp, Timestamp{} + 2.0 * static_cast<double>(i));
    EXPECT_NEAR(nodes[i].odometry.T_a_b.translation.x(), 2.0, 1e-12);
    EXPECT_NEAR(nodes[i].odometry.covariance(0, 0), 2e-4, 1e-12) << "two steps, and nothing besides";
    EXPECT_NEAR(nodes[i].odometry.covariance(5, 5), 2e-4, 1e-12);
  }
}

TEST(RobotNodes, EndWhereASubmapIsMissing) {
  server::SubmapSet submaps = straight(4, 4, 1e-4);
  submaps.erase({kChain, 2});
  const auto nodes = robot_nodes(submaps, kChain);
  ASSERT_FALSE(nodes.empty());
  EXPECT_EQ(nodes.back().submap, 1U);
  EXPECT_TRUE(robot_nodes(submaps, ChainId(RobotId{9})).empty());
}

TEST(CompareAll, SaysOfEverySessionWhereItPartsFromTheMap) {
  storage::MemoryStore store{storage::map_schema()};
  mapfile::test::Mapper mapper({RobotId{0}, RobotId{1}}, store);
  mapper.walk(kChain);
  mapper.walk({RobotId{1}, 5});
  mapfile::ShownMap shown{.revision = 2, .time = Timestamp{} + 50.0};
  shown.content = mapfile::read(store).value();
  shown.content.names = {{RobotId{0}, "alpha"}, {RobotId{1}, "bravo"}};
  shown.map = mapper.server().map();
  shown.broadcast = server::monitor_graph(shown.map, 2, {});
  const Comparisons found = compare_all(shown);
  ASSERT_EQ(found.messages.size(), 2U);
  EXPECT_EQ(found.messages.front().key, "disagreement/alpha");
  EXPECT_EQ(found.sigma_m.size(), shown.content.submaps.size());
  for (const auto& [id, sigma_m] : found.sigma_m) EXPECT_TRUE(sigma_m >= 0.0 && sigma_m < 10.0) << to_string(id);
  const auto value = nlohmann::json::parse(found.messages.front().value);
  EXPECT_FALSE(value.at("nodes").empty());
  for (const auto& node : value.at("nodes")) {
    EXPECT_EQ(node.at("d").size(), value.at("scale_length_m").size());
    EXPECT_TRUE(node.contains("submap"));
  }
}

TEST(CompareAll, BeforeTheFirstBroadcastThereIsNothing) { EXPECT_TRUE(compare_all({}).messages.empty()); }

}  // namespace view_disagreement_test
}  // namespace tutti::page
