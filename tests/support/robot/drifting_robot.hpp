// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tutti/consistency/chain_uncertainty.hpp"
#include "tutti/robot/agent.hpp"

/// A robot whose odometry turns too much on a large circle, and a server that knows better.
namespace tutti::robot::test {

inline const Matrix6d kStepCovariance = Vector6d(1e-4, 1e-4, 1e-4, 1e-5, 1e-5, 1e-4).asDiagonal();

inline Timestamp at(int sample) { return Timestamp{1'700'000'000'000'000'000LL} + 0.5 * sample; }

/// A loop of 40 m radius, half a metre a sample.
inline Pose3 true_pose(double sample) {
  const double angle = 0.0125 * sample;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle + std::numbers::pi / 2, Eigen::Vector3d::UnitZ())),
          {40.0 * std::cos(angle), 40.0 * std::sin(angle), 0.0}};
}

/// Odometry that turns 0.1 degrees too much per step.
inline Trajectory drifting_odometry(int samples) {
  const Pose3 bend{Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * std::numbers::pi / 180, Eigen::Vector3d::UnitZ())),
                   Eigen::Vector3d::Zero()};
  Trajectory out{{at(0), {}}};
  for (int i = 1; i < samples; ++i)
    out.push_back({at(i), out.back().pose * (true_pose(i - 1).inverse() * true_pose(i)) * bend});
  return out;
}

inline void feed(RobotAgent& agent, const Trajectory& odometry) {
  for (const StampedPose& sample : odometry)
    ASSERT_TRUE(agent.add(OdometrySample{sample.stamp, sample.pose, kStepCovariance}).has_value());
}

/// The server's view of what the agent uploaded: the truth, in a frame of its own, and another robot.
inline ProxyGraphMessage broadcast(const RobotAgent& agent, std::uint64_t revision, const Pose3& T_world_true,
                                   const Matrix6d& covariance = Matrix6d::Identity() * 1e-6) {
  ProxyGraphMessage message;
  message.graph.revision = revision;
  for (const Keyframe& k : agent.keyframes()) {
    if (!k.representative) continue;
    const double sample = (k.stamp - at(0)) / 0.5;
    message.graph.nodes.push_back({.chain = agent.chain(),
                                   .stamp = k.stamp,
                                   .T_world_body = T_world_true * true_pose(sample),
                                   .covariance = message.graph.nodes.empty() ? Matrix6d::Zero() : covariance});
  }
  message.graph.uncertainties = {
      consistency::even_uncertainty(agent.chain(), message.graph.nodes.size(), {0.002, 0.001})};
  message.graph.nodes.push_back({.chain = RobotId{9}, .stamp = at(3), .T_world_body = T_world_true * true_pose(7)});
  message.graph.components = {{agent.chain(), 0}, {RobotId{9}, 0}};
  const ProxyNode& other = message.graph.nodes.back();
  message.graph.last_seen = {{other.chain, other.stamp, other.T_world_body, {}}};
  return message;
}

inline const Pose3 kWorld{Eigen::Quaterniond(Eigen::AngleAxisd(2.0, Eigen::Vector3d(1, 2, 3).normalized())),
                          {100, -50, 7}};

/// As drifting_odometry(), in steps of a tenth: half a metre in ten samples.
inline Trajectory fine_odometry(int samples) {
  const Trajectory coarse = drifting_odometry(samples);
  Trajectory out;
  for (int i = 0; i < 10 * (samples - 1); ++i) {
    const Pose3 step = coarse[i / 10].pose.inverse() * coarse[i / 10 + 1].pose;
    out.push_back(
        {at(i / 10) + 0.05 * (i % 10), coarse[i / 10].pose * retract(Pose3{}, 0.1 * (i % 10) * local(Pose3{}, step))});
  }
  return out;
}

}  // namespace tutti::robot::test
