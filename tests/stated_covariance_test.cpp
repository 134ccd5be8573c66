// SPDX-License-Identifier: BSD-3-Clause
/// Wheels in the plane, whose drivers state all sorts of covariances: robot and server together make the best of it.
#include <gtest/gtest.h>

#include <numbers>

#include "tutti/evaluation/agreement.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/server/graph_monitor.hpp"
#include "tutti/server/map_estimate.hpp"

namespace tutti {
namespace stated_covariance_test {

constexpr RobotId kRobot{1};
constexpr double kRate_hz = 10.0;
constexpr double kClosureReach_m = 25.0;
constexpr double kRad = std::numbers::pi / 180.0;
const double kSigma_m = 0.01 / std::sqrt(kRate_hz);
const double kSigma_rad = 0.1 * kRad / std::sqrt(kRate_hz);

Timestamp at(int sample) { return Timestamp{1'700'000'000'000'000'000LL} + sample / kRate_hz; }
int sample_at(Timestamp stamp) { return static_cast<int>(std::lround((stamp - at(0)) * kRate_hz)); }

/// Round and round on a circle of 30 m radius at 1 m/s.
Pose3 on_circle(int sample) {
  const double angle = sample / kRate_hz / 30.0;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle + std::numbers::pi / 2, Eigen::Vector3d::UnitZ())),
          {30.0 * std::cos(angle), 30.0 * std::sin(angle), 0.0}};
}

/// The body rolls by 0.6 degrees, which odometry in the plane does not see.
Pose3 true_pose(int sample) {
  const Eigen::AngleAxisd roll(0.01 * std::sin(sample / kRate_hz), Eigen::Vector3d::UnitX());
  return on_circle(sample) * Pose3{Eigen::Quaterniond(roll), Eigen::Vector3d::Zero()};
}

void drive(robot::RobotAgent& agent, double sigma_m, double sigma_rad, double others) {
  Matrix6d covariance = Vector6d(sigma_m, sigma_m, 0.0, 0.0, 0.0, sigma_rad).cwiseAbs2().asDiagonal();
  for (const int axis : {2, 3, 4}) covariance(axis, axis) = others;
  Rng rng(7);
  Pose3 T_odom_body;
  for (int i = 0; i < 6000; ++i) {
    if (i > 0) {
      const double x = rng.normal(kSigma_m), y = rng.normal(kSigma_m), yaw = rng.normal(kSigma_rad);
      T_odom_body =
          retract(T_odom_body * (on_circle(i - 1).inverse() * on_circle(i)), Vector6d(x, y, 0.0, 0.0, 0.0, yaw));
    }
    ASSERT_TRUE(agent.add(OdometrySample{at(i), T_odom_body, covariance}));
  }
  agent.finish();
}

/// The server's map of the robot's submaps and true closures, 1 cm and 1 mrad off.
server::MapEstimate map_of(robot::RobotAgent& agent) {
  server::SubmapSet submaps;
  for (SubmapMessage& message : agent.take_outgoing())
    submaps[message.submap.id] = std::make_shared<const Submap>(std::move(message.submap));
  server::VerdictSet verdicts;
  Rng rng(9);
  for (auto a = submaps.begin(); a != submaps.end(); ++a)
    for (auto b = std::next(a); b != submaps.end(); ++b) {
      const Keyframe& from = a->second->keyframes[a->second->keyframes.size() / 2];
      const Keyframe& to = b->second->keyframes[b->second->keyframes.size() / 2];
      const Pose3 T = true_pose(sample_at(from.stamp)).inverse() * true_pose(sample_at(to.stamp));
      if (b->first.index < a->first.index + 3 || T.translation.norm() > kClosureReach_m) continue;
      const Vector6d sigma(0.01, 0.01, 0.01, 0.001, 0.001, 0.001);
      const RelativePose measured{retract(T, sigma.unaryExpr([&](double s) { return rng.normal(s); })),
                                  sigma.cwiseAbs2().asDiagonal()};
      verdicts[{a->first, b->first}] = {
          {a->first, b->first}, {{{kRobot, from.index}, {kRobot, to.index}, measured}}, {}};
    }
  return server::estimate_map(submaps, verdicts, {});
}

struct Errors {
  double raw_m = 0.0;
  double server_m = 0.0;
  double corrected_m = 0.0;
};

Errors errors_with(double sigma_m, double sigma_rad, double others) {
  robot::RobotAgent agent(kRobot, 0, {});
  drive(agent, sigma_m, sigma_rad, others);
  const auto error = [](const Trajectory& estimate) {
    Trajectory truth;
    for (const StampedPose& sample : estimate) truth.push_back({sample.stamp, true_pose(sample_at(sample.stamp))});
    return evaluation::agreement(estimate, truth)->rmse_m;
  };
  Errors out{.raw_m = error(agent.corrected())};
  const server::MapEstimate map = map_of(agent);
  Trajectory joint;
  for (const MapNode& node : map.nodes) joint.push_back({node.stamp, node.T_world_body});
  out.server_m = error(joint);
  ProxyGraph graph = server::monitor_graph(map, 1, {});
  for (graph.revision = 1; graph.revision <= 3; ++graph.revision) {
    const auto update = agent.receive({.header = {}, .graph = graph});
    EXPECT_TRUE(estimation::is_usable(update.optimised)) << to_string(update.optimised);
  }
  out.corrected_m = error(agent.corrected());
  return out;
}

TEST(StatedCovariance, HonestInThePlaneAndZeroBesideIsCorrected) {
  const Errors e = errors_with(kSigma_m, kSigma_rad, 0.0);
  EXPECT_GT(e.raw_m, 0.5);
  EXPECT_LT(e.corrected_m, 1.6 * e.server_m);
}

TEST(StatedCovariance, UnknownBesideNeverMakesMattersWorse) {
  for (const double others : {0.01, 1.0, 1e6}) {
    const Errors e = errors_with(kSigma_m, kSigma_rad, others);
    EXPECT_LT(e.corrected_m, e.raw_m + 0.02) << others;
    EXPECT_LT(e.server_m, e.raw_m) << others;
  }
}

}  // namespace stated_covariance_test
}  // namespace tutti
