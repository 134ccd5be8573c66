// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mapfile/export.hpp"

#include <gtest/gtest.h>

#include "support/mapfile/small_map.hpp"
#include "support/node/submaps.hpp"
#include "tutti/base/file.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/mapfile/placement.hpp"

namespace tutti::mapfile {
namespace export_test {

using test::Mapper;
namespace fs = std::filesystem;

class Export : public testing::Test {
 protected:
  Export() {
    fs::create_directories(folder_);
    Mapper mapper({RobotId{0}, RobotId{1}}, store_);
    for (const ChainId& chain : {ChainId(RobotId{0}, 5), ChainId(RobotId{0}, 6), ChainId(RobotId{1}, 5)})
      mapper.walk(chain);
    poses_ = mapper.server().map().graph.poses;
    edges_ = mapper.server().map().graph.edges.size();
  }
  ~Export() override { fs::remove_all(folder_); }

  storage::MemoryStore store_{storage::map_schema()};
  fs::path folder_ = fs::path(testing::TempDir()) / ("export_" + std::to_string(getpid()));
  std::vector<Pose3> poses_;
  std::size_t edges_ = 0;
};

TEST_F(Export, GraphTrajectoriesAndCloudAreThoseOfTheServersMap) {
  const Content content = read(store_).value();
  const server::MapEstimate map = estimate(content);
  ASSERT_TRUE(export_g2o(map, folder_ / "graph.g2o").has_value());
  const auto graph = formats::read_g2o((folder_ / "graph.g2o").string());
  ASSERT_TRUE(graph.has_value()) << graph.error().message;
  EXPECT_EQ(graph->graph.poses, poses_);
  EXPECT_EQ(graph->graph.edges.size(), edges_);
  const auto stamps = formats::read_graph_stamps((folder_ / "graph_stamps.csv").string());
  ASSERT_TRUE(stamps.has_value()) << stamps.error().message;
  ASSERT_EQ(stamps->size(), map.nodes.size());
  EXPECT_EQ(stamps->back().stamp, map.nodes.back().stamp);

  const auto files = export_tum(content, map, folder_ / "tum");
  ASSERT_TRUE(files.has_value()) << files.error().message;
  EXPECT_EQ(*files, (std::vector<std::string>{"0.tum", "0.2.tum", "1.tum"}));
  std::size_t poses = 0;
  for (const std::string& file : *files) {
    const auto trajectory = formats::read_trajectory((folder_ / "tum" / file).string(), "tum");
    ASSERT_TRUE(trajectory.has_value()) << trajectory.error().message;
    for (const StampedPose& pose : *trajectory) EXPECT_EQ(pose.pose, poses_.at(poses++));
  }
  EXPECT_EQ(poses, poses_.size());

  const auto cloud = export_cloud(store_, content, map, folder_ / "map.ply", formats::CloudFormat::ply);
  ASSERT_TRUE(cloud.has_value()) << cloud.error().message;
  EXPECT_EQ(cloud->submaps, content.submaps.size());
  EXPECT_EQ(cloud->left_out, 0U);
  const auto points = formats::read_ply((folder_ / "map.ply").string());
  ASSERT_TRUE(points.has_value());
  EXPECT_EQ(points->points.size(), cloud->points);
  // Where the middle keyframe of a submap is, its one point is.
  const Submap& first = *content.submaps.begin()->second;
  const Keyframe& middle = first.keyframes[first.keyframes.size() / 2];
  const auto node = std::ranges::find(map.nodes, KeyframeId{first.id.chain, middle.index}, &MapNode::id);
  const Pose3 T = node->T_world_body * middle.T_odom_body.inverse() * first.keyframes.front().T_odom_body;
  const Eigen::Vector3d expected = T * Eigen::Vector3d(1.0, 2.0, 0.0);
  double nearest = 1e9;
  for (const Eigen::Vector3f& point : points->points)
    nearest = std::min(nearest, (point.cast<double>() - expected).norm());
  EXPECT_LT(nearest, 0.15);  // a voxel, and the wire's rounding
  // It states how it lies to grids of the map.
  const std::string text = read_file((folder_ / "map.ply").string()).value();
  const Pose3 T_level_world = level_frame(map, node->component);
  EXPECT_NE(text.find("\ncomment frame: the map's world\ncomment " + in_words(T_level_world)), std::string::npos);
}

TEST(LevelFrame, HasTheMeanOfTheBodiesZAxesUp) {
  server::MapEstimate map;
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1.0, 2.0, 0.0).normalized()));
  for (std::uint32_t i = 0; i < 4; ++i) {
    const Eigen::AngleAxisd yaw(1.5 * i, Eigen::Vector3d::UnitZ());
    map.nodes.push_back(
        {.id = {{RobotId{0}, 5}, i}, .T_world_body = {tilt * yaw, {1.0 * i, 2.0, 3.0}}, .component = 1});
  }
  map.nodes.push_back({.id = {{RobotId{1}, 5}, 0}, .component = 0});
  const Pose3 T_level_world = level_frame(map, 1);
  EXPECT_LT((T_level_world.rotation * tilt * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_EQ(T_level_world.translation, Eigen::Vector3d::Zero());
  EXPECT_EQ(in_words(level_frame(map, 0)), "T_level_world 0 0 0 0 0 0 1 (x y z, quaternion x y z w)");
}

/// A body that looks along z, with y down, and turns.
server::MapEstimate camera_map(const Eigen::Quaterniond& tilt) {
  server::MapEstimate map;
  for (std::uint32_t i = 0; i < 4; ++i)
    map.nodes.push_back(
        {.id = {{RobotId{0}, 5}, i},
         .T_world_body = {tilt * Eigen::AngleAxisd(1.5 * i, Eigen::Vector3d::UnitY()), {1.0 * i, 0, 0}}});
  return map;
}

TEST(LevelFrame, CamerasHaveTheirYAxesDown) {
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX()));
  const server::MapEstimate map = camera_map(tilt);
  EXPECT_LT((level_frame(map, 0).rotation * tilt * -Eigen::Vector3d::UnitY() - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  const Pose3 upright = upright_frame(map, 0);
  EXPECT_LT((upright.rotation * Eigen::Vector3d(1.0, 2.0, 3.0) - Eigen::Vector3d(1.0, 3.0, -2.0)).norm(), 1e-9);
  EXPECT_EQ(upright_frame(camera_map(Eigen::Quaterniond::Identity()), 0).rotation.coeffs(), upright.rotation.coeffs())
      << "a small change of the map does not turn it";
}

TEST(DisagreementOnUp, NamesTwoRobotsThatAreTheOtherWayUp) {
  server::MapEstimate map;
  const Eigen::Quaterniond over(0.0, 1.0, 0.0, 0.0);
  for (std::uint32_t i = 0; i < 4; ++i) {
    const Eigen::Quaterniond yaw(Eigen::AngleAxisd(1.5 * i, Eigen::Vector3d::UnitZ()));
    map.nodes.push_back({.id = {{RobotId{0}, 5}, i}, .T_world_body = {yaw, {1.0 * i, 2.0, 3.0}}});
    map.nodes.push_back({.id = {{RobotId{1}, 5}, i}, .T_world_body = {yaw, {1.0 * i, 4.0, 3.0}}});
    map.nodes.push_back({.id = {{RobotId{2}, 5}, i}, .T_world_body = {over * yaw, {}}, .component = i < 2 ? 0U : 1U});
  }
  const auto warning = disagreement_on_up(Content{}, map, 0);
  ASSERT_TRUE(warning.has_value());
  EXPECT_NE(warning->find("'s up is"), std::string::npos) << *warning;
  EXPECT_FALSE(disagreement_on_up(Content{}, map, 1).has_value());
  std::erase_if(map.nodes, [](const MapNode& node) { return node.id.chain.robot == RobotId{2}; });
  EXPECT_FALSE(disagreement_on_up(Content{}, map, 0).has_value());
}

TEST(DisagreementOnUp, CamerasThatDriveTowardsEachOtherAgree) {
  server::MapEstimate map;
  for (std::uint32_t i = 0; i < 8; ++i)
    map.nodes.push_back(
        {.id = {{RobotId{i % 2}, 5}, i},
         .T_world_body = {Eigen::Quaterniond(Eigen::AngleAxisd(3.14 * (i % 2), Eigen::Vector3d::UnitY())),
                          {1.0 * i, 0, 0}}});
  EXPECT_FALSE(disagreement_on_up(Content{}, map, 0).has_value());
}

TEST(LevelFrame, AMapThatStandsIsShownAsItIs) {
  server::MapEstimate map;
  for (std::uint32_t i = 0; i < 4; ++i)
    map.nodes.push_back({.id = {{RobotId{0}, 5}, i},
                         .T_world_body = {Eigen::Quaterniond(Eigen::AngleAxisd(0.01 * i, Eigen::Vector3d::UnitY())),
                                          Eigen::Vector3d::Zero()}});
  EXPECT_EQ(upright_frame(map, 0), Pose3()) << "where nothing turns much, z is believed";
  for (MapNode& node : map.nodes) node.T_world_body.rotation = Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0);
  EXPECT_LT((upright_frame(map, 0).rotation * Eigen::Vector3d(1.0, 2.0, 3.0) - Eigen::Vector3d(1.0, -2.0, -3.0)).norm(),
            1e-9)
      << "upside down";
}

/// A small part has a camera on foot and a large one has none: there is something to see.
TEST_F(Export, WhereTheLargestPartHasNoCloudsTheCloudIsOfAnother) {
  Content content;
  server::MapEstimate map;
  map.components = 2;
  storage::MemoryStore store(storage::map_schema());
  const ChainId bare{RobotId{0}, 5}, seen{RobotId{1}, 5};
  for (const auto& [chain, submaps] : {std::pair{bare, 5U}, std::pair{seen, 2U}})
    for (std::uint32_t i = 0; i < submaps; ++i) {
      SubmapMessage message = node::test::submap(chain, i);
      if (chain == bare) message.submap.cloud.reset();
      const SubmapId id = message.submap.id;
      ASSERT_TRUE(store.commit(std::vector<storage::Write>{{"submaps", node::key_of(id), wire::encode(message)}}));
      if (chain == seen) content.payload_sizes[id] = payload_size(message.submap);
      for (const Keyframe& keyframe : message.submap.keyframes)
        if (i == 0 || &keyframe != &message.submap.keyframes.front())
          map.nodes.push_back({{chain, keyframe.index},
                               keyframe.stamp,
                               true,
                               keyframe.T_odom_body,
                               keyframe.T_odom_body,
                               chain.robot.value});
      content.submaps[id] = std::make_shared<const Submap>(without_payloads(std::move(message.submap)));
    }
  const auto cloud = export_cloud(store, content, map, folder_ / "map.ply", formats::CloudFormat::ply);
  ASSERT_TRUE(cloud.has_value()) << cloud.error().message;
  EXPECT_EQ(cloud->submaps, 2U);
  EXPECT_EQ(cloud->points, 2U);
  EXPECT_EQ(cloud->left_out, 0U);
  EXPECT_FALSE(cloud->of_the_largest);
}

TEST_F(Export, AFolderThatCannotBeMadeIsAnError) {
  const Content content = read(store_).value();
  const server::MapEstimate map = estimate(content);
  EXPECT_FALSE(export_g2o(map, folder_ / "nowhere" / "graph.g2o").has_value());
  EXPECT_FALSE(export_tum(content, map, "/dev/null/x").has_value());
  EXPECT_FALSE(
      export_cloud(store_, content, map, folder_ / "nowhere" / "map.ply", formats::CloudFormat::ply).has_value());
}

}  // namespace export_test
}  // namespace tutti::mapfile
