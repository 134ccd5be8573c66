// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/mission_config.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "support/paths.hpp"

namespace tutti::lab {
namespace mission_config_test {

std::string problem_with(const std::string& yaml, const std::vector<std::string>& assignments = {}) {
  const auto file = std::filesystem::temp_directory_path() / "tutti_mission_config_test.yaml";
  std::ofstream(file) << yaml;
  const auto config = load_mission(file, assignments);
  std::filesystem::remove(file);
  if (config) return "";
  EXPECT_EQ(config.error().code, ErrorCode::configuration) << config.error().message;
  return config.error().message;
}

constexpr const char* kGood =
    "robots: [{name: a, odometry: {file: a.tum}, reference: {file: a.tum}}]\nclosures: {verifier: reference}\n";

TEST(MissionConfig, TheDemosAreMissions) {
  const auto named = [](DemoSensors sensors) {
    const auto demo = demo_mission({}, sensors);
    return demo ? demo->mission + " " + demo->source + " " + demo->closures.verifier : demo.error().message;
  };
  EXPECT_EQ(named(DemoSensors::lidar), "demo simulation lidar");
  EXPECT_EQ(named(DemoSensors::visual), "hall hall visual");
  EXPECT_EQ(named(DemoSensors::both), "hall_mixed hall sensors");
  const auto by_name = load_mission("demo", {"agent.submap.duration_s=7"});
  ASSERT_TRUE(by_name.has_value()) << by_name.error().message;
  EXPECT_EQ(by_name->mission, "demo");
  EXPECT_EQ(by_name->agent.submap.duration_s, 7.0);
}

TEST(MissionConfig, WhatAMissionNeedsIsAskedForByName) {
  EXPECT_EQ(problem_with(kGood), "");
  EXPECT_NE(problem_with("mission: x\n").find("robots: none"), std::string::npos);
  EXPECT_NE(problem_with("robots: [{name: a}]\n").find("robots.0.odometry.file"), std::string::npos);
  EXPECT_NE(problem_with("robots: [{name: a, odometry: {file: a}}]\n").find("robots.0.scans"), std::string::npos);
  EXPECT_NE(problem_with("source: simulation\n").find("simulation.sensors"), std::string::npos);
  const std::string twins =
      "robots: [{name: a, odometry: {file: a}, scans: s}, {name: a, odometry: {file: b}, scans: s}]";
  EXPECT_NE(problem_with(twins).find("'a' is there twice"), std::string::npos);
  EXPECT_NE(problem_with("robots: [{name: 'a/b', odometry: {file: a}, scans: s}]").find("a/b"), std::string::npos);
}

TEST(MissionConfig, OfASettingThatIsGoneItIsSaidWhatToDo) {
  const auto expect = [](const std::string& more, const std::string& said) {
    const std::string problem = problem_with(kGood + more);
    EXPECT_NE(problem.find(said), std::string::npos) << problem;
  };
  expect("hall: {imu: false}\n", "hall.imu: is no setting any more: what was its default is always so");
  expect("place: {height_m: 3}\n", "place: is no setting any more");
  expect("simulation: {robots: [{odometry: {floor_m: 1}}]}\n",
         "simulation.robots.0.odometry.floor_m: is no setting any more: simulated odometry has a kind");
  expect("simulation: {robots: [{odometry: {degeneracy: {slide_percent: 2}}}]}\n", "set odometry.slide_percent");
  expect("robots_in_place: {}\n", "robots_in_place: unknown key");
}

TEST(MissionConfig, ImagesComeFromOnePlace) {
  const auto problem = [](const std::string& images, const std::string& odometry = "{file: a}") {
    return problem_with("robots: [{name: a, odometry: " + odometry + ", images: {" + images +
                        "}}]\nclosures: {verifier: visual}\n");
  };
  EXPECT_EQ(problem("euroc_folder: f, most_cameras: 1, time_offset_s: -0.01"), "");
  EXPECT_EQ(problem("list: l, cameras: c, imu: i"), "");
  EXPECT_EQ(problem("maplab_submaps: [s]", "{}"), "");
  const auto expect = [&](const std::string& images, const std::string& words) {
    EXPECT_NE(problem(images).find("robots.0." + words), std::string::npos) << problem(images);
  };
  expect("", "images: missing, but closures.verifier is 'visual'");
  expect("euroc_folder: f, list: l, cameras: c", "images: several of euroc_folder, list and maplab_submaps are given");
  expect("list: l", "images.cameras: missing, but images.list is given");
  expect("cameras: c", "images.list: missing, but images.cameras is given");
  expect("time_offset_s: 1", "images.time_offset_s: given, but there is no images.euroc_folder, images.list or bag");
  expect("euroc_folder: f, imu: i", "images.imu: given, but images.euroc_folder has its own in imu0");
  expect("euroc_folder: f, most_cameras: 3", "images.most_cameras: ");
  EXPECT_NE(problem("euroc_folder: f", "{}").find("robots.0.odometry.file: missing"), std::string::npos);
}

TEST(MissionConfig, ImuFactorsNeedRobotsThatSendTheirImu) {
  const auto problem = [](const std::string& send) {
    const auto mission = demo_mission({"refinement.merge.use_imu=true", "agent.submap.visual.send_imu=" + send});
    return mission ? std::string() : mission.error().message;
  };
  EXPECT_EQ(problem("true"), "");
  EXPECT_NE(problem("false").find("refinement.merge.use_imu: true, but"), std::string::npos) << problem("false");
}

TEST(MissionConfig, EurocsImagesAreAMission) {
  const auto mission = load_mission(test::source_path("missions/euroc_mh_images.yaml"), {});
  ASSERT_TRUE(mission.has_value()) << mission.error().message;
  ASSERT_EQ(mission->robots.size(), 3U);
  for (const mission::RobotConfig& robot : mission->robots) EXPECT_EQ(robot.images.euroc_folder.find("euroc/MH_0"), 0U);
}

TEST(MissionConfig, RobotsAreCalledWhatFilesCanBeCalled) {
  const auto problem = [](const std::string& name) {
    const auto mission = demo_mission({"simulation.robots=[{name: alpha}, {name: " + name + "}]"});
    return mission ? std::string() : mission.error().message;
  };
  EXPECT_EQ(problem("bravo_2-b"), "");
  EXPECT_EQ(problem("''"), "");  // named by place
  EXPECT_EQ(problem(std::string(64, 'b')), "");
  for (const std::string& name : {std::string("\u00fc"), std::string("../b"), std::string(65, 'b')})
    EXPECT_NE(problem(name).find("simulation.robots.1.name: is '" + name + "', expected at most 64 letters"),
              std::string::npos)
        << problem(name);
  const auto flying = demo_mission({"hall.robots.0.name=../b"}, DemoSensors::visual);
  ASSERT_FALSE(flying.has_value());
  EXPECT_NE(flying.error().message.find("hall.robots.0.name: is '../b'"), std::string::npos) << flying.error().message;
}

TEST(MissionConfig, WhereTheLidarSitsIsAPose) {
  const auto problem = [](const std::string& T_body_lidar) {
    return problem_with(kGood, {"robots.0.T_body_lidar={" + T_body_lidar + "}"});
  };
  EXPECT_EQ(problem("translation_m: [0.1, 0, 0.4], quaternion_xyzw: [0, 0, 0.7071068, 0.7071068]"), "");
  EXPECT_EQ(problem("rpy_deg: [0, 0, 90]"), "");
  EXPECT_NE(problem("translation_m: [0.1, 0]").find("robots.0.T_body_lidar.translation_m: 2 numbers, expected 3"),
            std::string::npos)
      << problem("translation_m: [0.1, 0]");
  EXPECT_NE(problem("quaternion_xyzw: [0, 0, 1, 1]").find("norm is 1.41421, expected 1 within 0.001"),
            std::string::npos)
      << problem("quaternion_xyzw: [0, 0, 1, 1]");
  for (const char* value : {"nan", "inf", "1e300"})
    for (const char* name : {"translation_m", "rpy_deg"})
      EXPECT_NE(problem(fmt::format("{}: [0, {}, 0]", name, value)), "") << name << value;
  EXPECT_NE(problem("quaternion_xyzw: [nan, 0, 0, 1]"), "");
  EXPECT_NE(problem("quaternion_xyzw: [0, 0, 0, 1], rpy_deg: [0, 0, 0]").find("expected one of them"),
            std::string::npos);
  // Roll, pitch and yaw about fixed axes: z is turned by the roll, then by the pitch, then by the yaw.
  const Pose3 T = mission::to_pose({.translation_m = {}, .quaternion_xyzw = {}, .rpy_deg = {90.0, 90.0, 90.0}}).value();
  EXPECT_LT((T.rotation * Eigen::Vector3d::UnitX() + Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  EXPECT_LT((T.rotation * Eigen::Vector3d::UnitZ() - Eigen::Vector3d::UnitX()).norm(), 1e-12);
}

TEST(MissionConfig, AssignmentsAreCheckedLikeTheFile) {
  EXPECT_EQ(problem_with(kGood, {"agent.policy.name=every_node", "compare_policies=[uniform]", "robots.0.start_s=5"}),
            "");
  EXPECT_NE(problem_with(kGood, {"robots.0.from_share=0.7", "robots.0.to_share=0.7"}).find("from_share 0.7"),
            std::string::npos);
  EXPECT_NE(problem_with(kGood, {"compare_policies=[oracle]"}).find("oracle"), std::string::npos);
  EXPECT_EQ(problem_with(kGood, {"link.outages=[{from_s: 5, until_s: .inf}]"}), "");
  EXPECT_NE(problem_with(kGood, {"link.outages=[{from_s: 5, until_s: 9}, {from_s: 50, until_s: 20}]"})
                .find("link.outages.1.until_s: is 20, expected at least from_s = 50"),
            std::string::npos);
  EXPECT_NE(problem_with(kGood, {"robot_links=[{robot: a, link: {outages: [{from_s: 2, until_s: 1}]}}]"})
                .find("robot_links.0.link.outages.0.until_s"),
            std::string::npos);
  EXPECT_NE(problem_with(kGood, {"server.update_least_s=1e-9"}).find("is 1e-09, expected at least 0.001"),
            std::string::npos);
  EXPECT_NE(problem_with(kGood, {"robots.0.start_s=.inf"}).find("start_s: is .inf"), std::string::npos);
  EXPECT_NE(problem_with(kGood, {"robots.0.reference_offset_m=[1, 2]"}).find("expected 3"), std::string::npos);
  EXPECT_EQ(problem_with(kGood, {"closures.planted=[{robot: a, at_s: 9}]"}), "");
  EXPECT_NE(problem_with(kGood, {"closures.planted=[{robot: a}]", "closures.verifier=lidar", "robots.0.scans=s"})
                .find("closures.planted"),
            std::string::npos);
}

}  // namespace mission_config_test
}  // namespace tutti::lab
