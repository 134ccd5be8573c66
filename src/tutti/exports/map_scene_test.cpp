// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/exports/map_scene.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "support/mapfile/small_map.hpp"
#include "tutti/mapfile/closures.hpp"

namespace tutti::exports {
namespace map_scene_test {

TEST(MapScene, TrajectoriesClosuresAndCloudAreTheMaps) {
  storage::MemoryStore store{storage::map_schema()};
  mapfile::test::Mapper mapper({RobotId{0}, RobotId{1}}, store);
  for (const ChainId& chain : {ChainId(RobotId{0}, 5), ChainId(RobotId{0}, 6), ChainId(RobotId{1}, 5)})
    mapper.walk(chain);
  const mapfile::Content content = mapfile::read(store).value();
  const server::MapEstimate map = mapfile::estimate(content);
  const Scene scene = scene_of_map(store, content, map).value();

  std::set<std::string> topics;
  std::size_t poses = 0;
  for (const Scene::Track& track : scene.tracks) {
    topics.insert(track.topic);
    poses += track.poses.size();
  }
  EXPECT_EQ(topics, (std::set<std::string>{"robot_0/odometry", "robot_0/server", "robot_0_2/odometry",
                                           "robot_0_2/server", "robot_1/odometry", "robot_1/server"}));
  EXPECT_EQ(poses, 2 * map.nodes.size());
  // world -> odom -> base_link is where the map has the body.
  const auto find = [&](const std::string& child) {
    return *std::ranges::find(scene.motions, child, &Scene::Motion::child);
  };
  const Scene::Motion T_world_odom = find("robot_1/odom"), T_odom_body = find("robot_1/base_link");
  EXPECT_EQ(T_world_odom.parent, "world");
  const auto server = *std::ranges::find(scene.tracks, "robot_1/server", &Scene::Track::topic);
  for (std::size_t i = 0; i < server.poses.size(); ++i)
    EXPECT_LT(local(server.poses[i].pose, T_world_odom.poses[i].pose * T_odom_body.poses[i].pose).norm(), 1e-9);

  std::size_t drawn = 0;
  for (const mapfile::ClosureInfo& info : mapfile::closures(content, map))
    for (const mapfile::ClosureFit& fit : info.closures) drawn += fit.misfit ? 1 : 0;
  EXPECT_EQ(scene.closures.size(), drawn);
  EXPECT_TRUE(std::ranges::any_of(scene.closures,
                                  [](const auto& one) { return one.state == "rejected" && !one.reason.empty(); }));
  EXPECT_TRUE(std::ranges::any_of(scene.closures,
                                  [](const auto& one) { return one.state == "accepted" && one.between_robots; }));
  ASSERT_EQ(scene.clouds.size(), 1U);
  EXPECT_EQ(scene.clouds[0].frame, "world");
}

}  // namespace map_scene_test
}  // namespace tutti::exports
