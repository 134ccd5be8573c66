// SPDX-License-Identifier: BSD-3-Clause
// Small runs with a known difference between server and robot, for the tests, the bench and the threshold sweep.
#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/consistency/proxy_graph_builder.hpp"
#include "tutti/consistency/robot_node.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency::test {

inline constexpr double kNodePeriod_s = 3.0;
inline constexpr double kSubmap_s = 10.0;
inline const RobotId kAlpha{1}, kBravo{2};

inline Timestamp stamp_of(std::size_t node) {
  return Timestamp{1'000'000'000} + kNodePeriod_s * static_cast<double>(node);
}
inline std::uint32_t submap_of(std::size_t node) {
  return static_cast<std::uint32_t>(kNodePeriod_s * static_cast<double>(node) / kSubmap_s);
}

inline Pose3 random_pose(Rng& rng, double extent_m) {
  const Eigen::Vector3d turn(rng.normal(), rng.normal(), rng.normal());
  return {so3_exp(turn), extent_m * Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal())};
}

inline Pose3 at(double x, double y, double z) { return {Eigen::Quaterniond::Identity(), {x, y, z}}; }

inline std::vector<Pose3> moved(const Pose3& T, std::vector<Pose3> poses) {
  for (Pose3& pose : poses) pose = T * pose;
  return poses;
}

/// `length` nodes, one per metre, through corridors on a grid of 60 x 40 m blocks that are walked several times;
/// heading along the path, gentle slopes.
inline std::vector<Pose3> corridor(std::size_t length) {
  const std::vector<Eigen::Vector2d> corners = {
      {0, 0},   {60, 0}, {120, 0}, {120, 40}, {60, 40},  {60, 0},   {0, 0},   {0, 40},  {60, 40},
      {60, 80}, {0, 80}, {0, 40},  {60, 40},  {120, 40}, {120, 80}, {60, 80}, {60, 40}, {60, 0},
      {0, 0},   {0, 40}, {0, 80},  {60, 80},  {120, 80}, {120, 0},  {60, 0},  {0, 0}};
  std::vector<Eigen::Vector3d> points;
  for (std::size_t corner = 0; points.size() < length + 2; ++corner) {
    const Eigen::Vector2d from = corners[corner % (corners.size() - 1)],
                          to = corners[corner % (corners.size() - 1) + 1];
    const Eigen::Vector2d along = (to - from).normalized(), aside(-along.y(), along.x());
    const double shift = 0.3 * std::sin(1.7 * static_cast<double>(corner));  // never twice quite the same line
    for (double s = 0.0; s < (to - from).norm(); s += 1.0) {
      const Eigen::Vector2d p = from + s * along + shift * aside;
      points.emplace_back(p.x(), p.y(), 0.02 * p.x() + 0.5 * std::sin(0.05 * p.y()));
    }
  }
  std::vector<Pose3> poses;
  for (std::size_t i = 0; i < length; ++i) {
    const Eigen::Vector3d ahead = points[i + 2] - points[i];
    poses.push_back({so3_exp(Eigen::Vector3d(0, 0, std::atan2(ahead.y(), ahead.x()))), points[i + 1]});
  }
  return poses;
}

/// `length` nodes, one per metre, half of them into a winding tunnel and half of them back, 3 m beside: some 26
/// neighbours within 7 m, as in the paper's tunnel.
inline std::vector<Pose3> tunnel(std::size_t length) {
  std::vector<Pose3> out;
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  for (std::size_t n = 0; n < (length + 1) / 2; ++n) {
    const double heading = 0.8 * std::sin(static_cast<double>(n) / 70.0);
    out.push_back({so3_exp(Eigen::Vector3d(0, 0, heading)), at});
    at += Eigen::Vector3d(std::cos(heading), std::sin(heading), 0.02);
  }
  for (std::size_t n = out.size(); out.size() < length;) {
    const Pose3& there = out[--n];
    out.push_back({there.rotation * so3_exp(Eigen::Vector3d(0, 0, std::numbers::pi)),
                   there.translation + there.rotation * Eigen::Vector3d(0.5, 3.0, 0.0)});
  }
  return out;
}

struct ServerNoise {
  double smooth_m = 0.07;  ///< Amplitude of an error with wavelengths of some 100 m.
  double local_m = 0.005;  ///< Independent per node.
  double local_rad = 0.001;
};

/// The appearance of an optimised joint map: truth + a smooth error + a little noise per node.
inline std::vector<Pose3> server_estimate(const std::vector<Pose3>& truth, const ServerNoise& noise, Rng rng) {
  Eigen::Vector3d phase(rng.uniform(0, 6), rng.uniform(0, 6), rng.uniform(0, 6));
  std::vector<Pose3> out;
  for (std::size_t n = 0; n < truth.size(); ++n) {
    const double s = static_cast<double>(n);
    const Eigen::Vector3d smooth(std::sin(s / 40.0 + phase.x()), std::sin(s / 55.0 + phase.y()),
                                 0.5 * std::sin(s / 70.0 + phase.z()));
    const auto white = [&](double sigma) {
      return Eigen::Vector3d(rng.normal(sigma), rng.normal(sigma), rng.normal(sigma));
    };
    out.push_back({truth[n].rotation * so3_exp(white(noise.local_rad)),
                   truth[n].translation + noise.smooth_m * smooth + white(noise.local_m)});
  }
  return out;
}

struct OdometryNoise {
  double translation_m = 0.01;  ///< Random walk, per square root of metre.
  double rotation_rad = 0.001;  ///< Random walk, per square root of metre.
  double yaw_bias_rad = 0.0;    ///< Per metre.
  double scale_bias = 0.0;      ///< Share of the distance.
};

/// Increments node -> node + 1 as odometry measures them.
inline std::vector<Pose3> odometry_increments(const std::vector<Pose3>& truth, const OdometryNoise& noise, Rng rng) {
  std::vector<Pose3> out;
  for (std::size_t n = 0; n + 1 < truth.size(); ++n) {
    Pose3 T = truth[n].inverse() * truth[n + 1];
    const double root = std::sqrt(T.translation.norm());
    const auto white = [&](double sigma) {
      return Eigen::Vector3d(rng.normal(sigma), rng.normal(sigma), rng.normal(sigma));
    };
    T.rotation = T.rotation * so3_exp(white(noise.rotation_rad * root) +
                                      Eigen::Vector3d(0, 0, noise.yaw_bias_rad * T.translation.norm()));
    T.translation = (1.0 + noise.scale_bias) * T.translation + white(noise.translation_m * root);
    out.push_back(T);
  }
  return out;
}

inline std::vector<Pose3> integrate(const Pose3& first, const std::vector<Pose3>& increments) {
  std::vector<Pose3> poses{first};
  for (const Pose3& T : increments) poses.push_back(poses.back() * T);
  return poses;
}

inline Matrix6d covariance_of(const OdometryNoise& noise) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(noise.translation_m), Eigen::Vector3d::Constant(noise.rotation_rad);
  return sigma.array().square().matrix().asDiagonal();
}

inline std::vector<ServerNode> server_nodes(RobotId robot, const std::vector<Pose3>& poses,
                                            const Matrix6d& covariance = covariance_of({})) {
  std::vector<ServerNode> out;
  for (std::size_t n = 0; n < poses.size(); ++n) out.push_back({robot, stamp_of(n), poses[n], covariance});
  return out;
}

/// `increments`: raw odometry from node to node; without it the poses are odometry's.
inline std::vector<RobotNode> robot_nodes(const std::vector<Pose3>& poses, const std::vector<Pose3>& increments = {}) {
  std::vector<RobotNode> out;
  for (std::size_t n = 0; n < poses.size(); ++n) {
    RelativePose odometry{.covariance = covariance_of({})};
    if (n > 0) odometry.T_a_b = increments.empty() ? poses[n - 1].inverse() * poses[n] : increments[n - 1];
    out.push_back({.stamp = stamp_of(n),
                   .T_map_body = poses[n],
                   .chain_index = 3 * n,
                   .odometry = odometry,
                   .submap = submap_of(n)});
  }
  return out;
}

/// One robot's unreduced proxy graph.
inline ProxyGraph proxy_graph(const std::vector<Pose3>& poses, const ProxyGraphConfig& config = {}) {
  return build_proxy_graph(1, server_nodes(kAlpha, poses), {{kAlpha, 0}}, config);
}

}  // namespace tutti::consistency::test
