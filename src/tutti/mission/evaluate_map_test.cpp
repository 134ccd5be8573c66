// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include "support/server/world.hpp"
#include "tutti/mission/evaluate.hpp"

namespace tutti::mission {
namespace evaluate_map_test {

/// Both robots of the server's test world, on a circle with posts beside it, each seen by the submap that passes it.
class EvaluateMap : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const RobotId robot : robots_) walk(robot);
    record_.default_policy = "skeleton";
    record_.server.T_reference_world = T_reference_world_;
    auto survey = std::make_shared<PointCloud>();
    for (const RobotId robot : robots_)
      for (std::uint32_t k = 0; k < kKeyframes; ++k)
        for (const auto& p : posts(server::test::true_pose(robot, k)).points) survey->points.push_back(p);
    record_.survey = survey;
  }

  static PointCloud posts(const Pose3& T_a_body) {
    PointCloud out;
    for (const double side : {-2.0, 2.0})
      for (const double z : {0.0, 0.5, 1.0})
        out.points.push_back((T_a_body * Eigen::Vector3d(0.0, side, z)).cast<float>());
    return out;
  }

  /// Submaps into the server, whose map is off by nothing; the robot's own estimates into the record. The odometry
  /// segments 2 %, the corrected estimate 0.2 %.
  void walk(RobotId id) {
    RobotRecord& robot = record_.robots.emplace_back(RobotRecord{.id = id, .name = "robot"});
    robot.policies.push_back({.name = "skeleton"});
    Submap open{.id = {id, 0}};
    for (std::uint32_t k = 0; k < kKeyframes; ++k) {
      const Pose3 truth = server::test::true_pose(id, k);
      const Timestamp stamp{1'000'000'000LL * (k + 1)};
      robot.reference.push_back({stamp, truth});
      robot.odometry.push_back({stamp, T_odom_reference_ * segmented(truth, 1.02)});
      robot.policies[0].corrected.push_back({stamp, T_odom_reference_ * segmented(truth, 1.002)});
      robot.server_estimate.push_back({stamp, T_reference_world_.inverse() * truth});
      const Pose3& T_odom_body = robot.odometry.back().pose;
      if (!open.keyframes.empty())
        open.odometry.push_back({open.keyframes.back().T_odom_body.inverse() * T_odom_body, Matrix6d::Identity()});
      open.keyframes.push_back({k, stamp, T_odom_body, true});
      if (open.keyframes.size() == 6 || k + 1 == kKeyframes) send(open);
    }
  }
  static Pose3 segmented(Pose3 pose, double by) {
    pose.translation *= by;
    return pose;
  }
  void send(Submap& open) {
    const Keyframe& first = open.keyframes.front();
    const Keyframe& middle = open.keyframes[open.keyframes.size() / 2];
    const PointCloud seen = posts(first.T_odom_body.inverse() * middle.T_odom_body);
    if (by_camera_)
      open.visual = landmarks(seen, first.index);
    else
      open.cloud = std::make_shared<const PointCloud>(seen);
    seen_.emplace_back(middle.index);
    const SubmapMessage message{.header = {.robot = open.id.chain.robot}, .submap = open};
    const auto taken = server_.receive(message);
    ASSERT_TRUE(taken) << taken.error().message;
    open = {.id = {open.id.chain, open.id.index + 1}, .keyframes = {open.keyframes.back()}};
  }
  /// Each point, and another that is known too badly to be shown.
  static std::shared_ptr<const VisualPayload> landmarks(const PointCloud& points, std::uint32_t keyframe) {
    VisualPayload out{.cameras = {{}}, .frames = {{keyframe, 0, {}}}};
    for (const Eigen::Vector3f& p : points.points)
      for (const float sigma_m : {0.0F, 1.0F}) {
        out.frames[0].observations.push_back({.landmark = static_cast<std::uint32_t>(out.landmarks.size())});
        out.landmarks.push_back({(1.0F + sigma_m) * p, sigma_m});
      }
    return std::make_shared<const VisualPayload>(std::move(out));
  }
  void evaluate() { evaluate_map(server_, {}, record_); }

  static constexpr std::uint32_t kKeyframes = 41;
  const std::set<RobotId> robots_{RobotId{0}, RobotId{1}};
  const Pose3 T_odom_reference_{Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d::UnitZ())), {9.0, -4.0, 1.0}};
  const Pose3 T_reference_world_{Eigen::Quaterniond(Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitX())),
                                 {100.0, 20.0, 3.0}};
  server::MapServer server_{robots_, std::make_shared<const server::test::TestVerifier>(1),
                            std::make_shared<server::MemoryPayloadStore>(), server::ServerConfig{}, 1};
  std::vector<std::uint32_t> seen_;
  bool by_camera_ = false;
  MissionRecord record_;
};

TEST_F(EvaluateMap, EveryEstimatePlacesTheCloudsWhereItBelievesTheyWere) {
  evaluate();
  ASSERT_EQ(record_.server.clouds.size(), 2U);
  std::size_t points = 0;
  for (const CloudRecord& seen : record_.server.clouds) {
    points += seen.cloud.points.size();
    for (const float d : seen.distance_m) EXPECT_LT(d, 1e-3F);  // the server's poses are the truth
  }
  EXPECT_EQ(points, 6 * seen_.size());
  ASSERT_TRUE(record_.server.map_error);
  EXPECT_LE(record_.server.map_error->points, points);  // what both robots saw counts once
  EXPECT_GT(record_.server.map_error->points, points / 2);
  for (const RobotRecord& robot : record_.robots) {
    ASSERT_TRUE(robot.map_error.onboard && robot.map_error.corrected);
    // 2 % of 10 m, less what the alignment takes; 0.2 % is a tenth of that.
    EXPECT_GT(robot.map_error.onboard->mean_m, 0.05);
    EXPECT_LT(robot.map_error.onboard->mean_m, 0.25);
    EXPECT_NEAR(robot.map_error.corrected->mean_m, 0.1 * robot.map_error.onboard->mean_m,
                0.03 * robot.map_error.onboard->mean_m);
    EXPECT_FALSE(robot.onboard_cloud.points.empty());
  }
}

class EvaluateLandmarks : public EvaluateMap {
 protected:
  EvaluateLandmarks() { by_camera_ = true; }
};

TEST_F(EvaluateLandmarks, TheMapOfACameraIsItsGoodLandmarks) {
  evaluate();
  ASSERT_EQ(record_.server.clouds.size(), 2U);
  std::size_t points = 0;
  for (const CloudRecord& seen : record_.server.clouds) {
    points += seen.cloud.points.size();
    for (const float d : seen.distance_m) EXPECT_LT(d, 1e-3F);
  }
  EXPECT_EQ(points, 6 * seen_.size());
  ASSERT_EQ(record_.notes.size(), 1U);
  EXPECT_TRUE(record_.notes[0].starts_with("robot, robot: what it saw is shown by its landmarks")) << record_.notes[0];
}

TEST_F(EvaluateMap, SaysHowMuchOfTheSurveyTheMapHolds) {
  evaluate();
  // One keyframe in five has its posts in a submap; neighbours are a metre away, inner posts 0.8 m.
  ASSERT_TRUE(record_.server.survey_covered);
  EXPECT_GT(*record_.server.survey_covered, 0.15);
  EXPECT_LT(*record_.server.survey_covered, 0.35);
}

TEST_F(EvaluateMap, OnlyTheLargestComponentCounts) {
  record_.robots[1].component = 1;
  evaluate();
  EXPECT_EQ(record_.server.map_error->points, record_.server.clouds[0].cloud.points.size());
  EXPECT_FALSE(record_.server.clouds[0].distance_m.empty());
  EXPECT_TRUE(record_.server.clouds[1].distance_m.empty());
}

TEST_F(EvaluateMap, WithoutSurveyThereIsAMapButNoError) {
  record_.survey = nullptr;
  evaluate();
  EXPECT_EQ(record_.server.clouds.size(), 2U);
  EXPECT_TRUE(record_.server.clouds[0].distance_m.empty());
  EXPECT_FALSE(record_.server.map_error);
  EXPECT_FALSE(record_.robots[0].map_error.onboard);
  EXPECT_FALSE(record_.robots[0].onboard_cloud.points.empty());
}

TEST_F(EvaluateMap, WithoutReferenceTheOnboardMapIsLaidOnTheServers) {
  record_.server.T_reference_world.reset();
  for (RobotRecord& robot : record_.robots) robot.reference.clear();
  evaluate();
  EXPECT_FALSE(record_.server.map_error);
  EXPECT_FALSE(record_.robots[0].map_error.onboard);
  const evaluation::CloudIndex server(record_.server.clouds[0].cloud);
  for (const float d : server.distances(record_.robots[0].onboard_cloud)) EXPECT_LT(d, 0.5F);
}

}  // namespace evaluate_map_test
}  // namespace tutti::mission
