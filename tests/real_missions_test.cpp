// SPDX-License-Identifier: BSD-3-Clause
// The missions on real recordings, with the figures they have to keep. Skipped without ../shared.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <string>

#include "support/bags/robot_bag.hpp"
#include "support/server/optimum.hpp"
#include "support/shared_data.hpp"
#include "tutti/formats/kitti.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/lab/run_mission.hpp"
#include "tutti/mission/worst_update.hpp"

namespace tutti::mission {
namespace real_missions_test {

lab::MissionConfig mission_file(const std::string& name) {
  auto config = lab::load_mission(test::source_path("missions/" + name + ".yaml"), {});
  EXPECT_TRUE(config.has_value()) << config.error().message;
  return config ? *config : lab::MissionConfig{};
}

MissionRecord run(const lab::MissionConfig& config, std::uint64_t seed) {
  auto record = lab::run_mission(
      config, {.data = test::shared_path("data"), .seed = seed, .updated = server::test::expect_optimum});
  EXPECT_TRUE(record.has_value()) << record.error().message;
  return record ? *record : MissionRecord{};
}

const PolicyRecord& corrected(const MissionRecord& record, const RobotRecord& robot) {
  return *std::find_if(robot.policies.begin(), robot.policies.end(),
                       [&](const PolicyRecord& p) { return p.name == record.default_policy; });
}

std::size_t inter_robot(const MissionRecord& record) {
  return static_cast<std::size_t>(
      std::count_if(record.server.closures.begin(), record.server.closures.end(),
                    [](const ClosureRecord& c) { return c.from.chain.robot != c.to.chain.robot; }));
}

TEST(RealMissions, HkuTwoSessionsAreJoinedFromTheirScans) {
  TUTTI_REQUIRE_SHARED("data/lidar/hku_two_sessions");
  const MissionRecord record = run(mission_file("hku_two_sessions"), 1);
  EXPECT_EQ(record.server.components, 1U);
  EXPECT_GE(inter_robot(record), 60U);
  ASSERT_TRUE(record.server.closure_check.has_value());
  EXPECT_EQ(record.server.closure_check->wrong, 0U);
  ASSERT_EQ(record.transforms.size(), 1U);
  ASSERT_TRUE(record.transforms[0].error_m.has_value());
  EXPECT_LT(*record.transforms[0].error_m, 0.03);
  EXPECT_LT(*record.transforms[0].error_deg, 0.15);
  for (const RobotRecord& robot : record.robots) {
    EXPECT_LT(*corrected(record, robot).agreement_rmse_m, 0.02);
    EXPECT_FALSE(robot.onboard.rmse_m.has_value());  // no ground truth: nothing is claimed
  }
}

/// As bags, in one storage each, the sessions are what they are as files: the same closures and poses, bit by bit.
TEST(RealMissions, HkuFromBagsIsHkuFromFiles) {
  TUTTI_REQUIRE_SHARED("data/lidar/hku_two_sessions");
  const std::filesystem::path data = test::shared_path("data/lidar/hku_two_sessions"),
                              folder = std::filesystem::path(::testing::TempDir()) / fmt::format("hku_{}", getpid());
  lab::MissionConfig files, bags;
  for (const std::string session : {"hku_session1", "hku_session2"}) {
    const auto poses =
        formats::with_times(formats::read_trajectory((data / session / "odom_poses.txt").string(), "kitti").value(),
                            formats::read_times((data / session / "times.txt").string()).value());
    files.robots.push_back(
        {.name = session,
         .odometry = {.file = session + "/odom_poses.txt", .format = "kitti", .times = session + "/times.txt"},
         .scans = session + "/Scans"});
    bags.robots.push_back({.name = session, .bag = (folder / session).string()});
    const bool first = session == "hku_session1";
    bags::test::write_rosbag2(folder / session, bags::test::samples_of(*poses, data / session / "Scans", 1000),
                              first ? bags::test::Storage::mcap : bags::test::Storage::db3, bags::test::Packing::none,
                              150);
  }
  const auto of_files = lab::run_mission(files, {.data = data, .seed = 1});
  const auto of_bags = lab::run_mission(bags, {.seed = 1});
  std::filesystem::remove_all(folder);
  ASSERT_TRUE(of_files && of_bags) << of_bags.error().message;
  ASSERT_EQ(of_files->server.closures.size(), of_bags->server.closures.size());
  EXPECT_GT(inter_robot(*of_bags), 60U);
  for (std::size_t i = 0; i < of_files->server.closures.size(); ++i) {
    EXPECT_EQ(of_files->server.closures[i].from, of_bags->server.closures[i].from);
    EXPECT_EQ(of_files->server.closures[i].to, of_bags->server.closures[i].to);
  }
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(of_files->robots[i].server_estimate, of_bags->robots[i].server_estimate);
    EXPECT_EQ(corrected(*of_files, of_files->robots[i]).corrected, corrected(*of_bags, of_bags->robots[i]).corrected);
  }
}

TEST(RealMissions, HkuDegradedIsRepaired) {
  TUTTI_REQUIRE_SHARED("data/lidar/hku_two_sessions");
  const MissionRecord record = run(mission_file("hku_degraded"), 1);
  EXPECT_EQ(record.server.components, 1U);
  EXPECT_EQ(record.server.closure_check->wrong, 0U);
  EXPECT_LT(*record.server.joint.rmse_m, 0.05);
  for (const RobotRecord& robot : record.robots) {
    EXPECT_GT(*robot.onboard.rmse_m, 0.4);
    EXPECT_LT(*corrected(record, robot).accuracy.rmse_m, 1.1 * *robot.server.rmse_m + 0.01);
    // Its drift goes in one direction all along, which bends submaps by more than closures allow for: 0.0035 m instead
    // of 0.0032.
    EXPECT_LE(*corrected(record, robot).accuracy.rpe_m, 1.15 * *robot.onboard.rpe_m);
  }
}

/// And they bring it home: its odometry is 579 m off.
TEST(RealMissions, ADivergedRobotHarmsNobody) {
  TUTTI_REQUIRE_SHARED("data/excavator_mm");
  lab::MissionConfig config = mission_file("excavator_diverged");
  const MissionRecord with = run(config, 1);
  config.robots.pop_back();  // the diverged one
  const MissionRecord without = run(config, 1);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT(*with.robots[i].server.rmse_m, *without.robots[i].server.rmse_m + 0.01);
    EXPECT_LT(*corrected(with, with.robots[i]).accuracy.rmse_m,
              *corrected(without, without.robots[i]).accuracy.rmse_m + 0.01);
  }
  EXPECT_EQ(with.server.components, 1U);
  EXPECT_LT(*with.robots[2].server.rmse_m, 2.0);
  EXPECT_LT(*corrected(with, with.robots[2]).accuracy.rmse_m, 2.0);
}

TEST(RealMissions, KittiSequencesOfTwoPlacesBecomeTwoMaps) {
  TUTTI_REQUIRE_SHARED("data/kitti");
  const MissionRecord record = run(mission_file("kitti_00_05"), 1);
  EXPECT_EQ(record.server.components, 2U);
  EXPECT_EQ(record.server.closure_check->wrong, 0U);
  for (const RobotRecord& robot : record.robots)
    EXPECT_LT(*corrected(record, robot).accuracy.rmse_m, 1.1 * *robot.server.rmse_m + 0.05);
}

/// Seed 9: the nine closures of the second robot with itself are all wrong, by one look-alike. Each of them agrees with
/// the others and with the odometry, which is loose over 800 m; together they contradict all the rest.
TEST(RealMissions, NineClosuresAtOnePairOfPlacesAreOneWitness) {
  TUTTI_REQUIRE_SHARED("data/kitti");
  lab::MissionConfig config = mission_file("kitti_00_halves");
  config.agent.submap.distance_m = std::numeric_limits<double>::infinity();  // of 10 s: one look-alike, three pairs
  const MissionRecord record = run(config, 9);
  ASSERT_TRUE(record.server.closure_check.has_value());
  EXPECT_GT(record.server.closure_check->checked, 50U);
  EXPECT_EQ(record.server.closure_check->wrong, 0U);
  EXPECT_LT(*record.robots[1].server.rmse_m, 1.0);  // 3.9 with them; raw odometry 2.65
}

TEST(RealMissions, EurocFlightsAgreeWithTheJointMap) {
  TUTTI_REQUIRE_SHARED("data/euroc/MH_01");
  const MissionRecord record = run(mission_file("euroc_mh"), 1);
  EXPECT_EQ(record.server.components, 1U);
  EXPECT_EQ(record.server.closure_check->wrong, 0U);
  for (const RobotRecord& robot : record.robots) {
    EXPECT_LT(*robot.server.rmse_m, *robot.onboard.rmse_m);
    EXPECT_LT(*corrected(record, robot).accuracy.rmse_m, 1.1 * *robot.server.rmse_m + 0.02);
  }
}

/// Three parts of one flight with a camera, adjusted apart at first: a dozen closures are asked for before two of them
/// are one map. When they join, neither map nor robots leave the room.
TEST(RealMissions, PartsThatJoinLateAreNeverFarOff) {
  TUTTI_REQUIRE_SHARED("data/euroc/V1_01");
  lab::MissionConfig config = mission_file("euroc_v101_rovio");
  config.server.map.outlier_rejection.min_joining_closures = 12;
  config.duration_s = 45.0;
  const MissionRecord record = run(config, 1);
  EXPECT_EQ(record.server.components, 1U);
  EXPECT_TRUE(record.server.refinement.has_value());
  for (const RobotRecord& robot : record.robots)
    for (const auto& worst : {worst_of_server(robot.updates), worst_of_policy(robot.updates, record.default_policy)}) {
      ASSERT_TRUE(worst.has_value());
      EXPECT_LT(worst->rmse_m, worst->onboard_rmse_m + 0.05) << robot.name << " at " << worst->time_s << " s";
    }
}

/// Flights of other people's odometry through one room; closures from the truth, one in ten wrong.
MissionRecord run_case(const std::string& name, std::uint64_t seed) {
  auto config = lab::load_mission(test::shared_path("cases/rooms/" + name + ".yaml"), {});
  EXPECT_TRUE(config.has_value()) << config.error().message;
  return config ? run(*config, seed) : MissionRecord{};
}

// The stamps of this odometry are 50 ms late: in a fast turn 1.4 degrees, five times what the closures claim.
TEST(RealMissions, LateStampsInASmallRoomCostNoClosures) {
  TUTTI_REQUIRE_SHARED("cases/rooms");
  for (const std::uint64_t seed : {1U, 2U}) {
    const MissionRecord record = run_case("v1_two_flights", seed);
    EXPECT_EQ(record.server.components, 1U);
    EXPECT_GE(record.server.closures.size(), 90U);  // of 106
    EXPECT_EQ(record.server.closure_check->wrong, 0U);
    for (const RobotRecord& robot : record.robots)
      EXPECT_LT(*robot.server.rmse_m, 1.05 * *robot.perfect->rmse_m) << robot.name << ", seed " << seed;
  }
}

TEST(RealMissions, AFlightWhoseOdometryFailsKeepsItsRoom) {
  TUTTI_REQUIRE_SHARED("cases/rooms");
  const MissionRecord record = run_case("v2_three_flights", 5);
  EXPECT_EQ(record.server.components, 1U);
  EXPECT_GE(record.server.closures.size(), 330U);  // of 390
  EXPECT_EQ(record.server.closure_check->wrong, 0U);
  for (const RobotRecord& robot : record.robots)  // 1.44, 1.00, 1.20
    EXPECT_LT(*robot.server.rmse_m, 1.5 * *robot.perfect->rmse_m) << robot.name;
}

}  // namespace real_missions_test
}  // namespace tutti::mission
