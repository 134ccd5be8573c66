// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "support/mission/report/explanation_example.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/record.hpp"

/// For tests of the report only: a made-up mission record with plausible shapes. Its figures mean nothing.
namespace tutti::mission::test {

struct ExampleOptions {
  std::size_t robots = 2;
  std::size_t keyframes = 120;  ///< Per robot, one every 2 s.
  bool reference = true;
  bool cloud = false;   ///< Pictures take their time.
  bool survey = false;  ///< Implies a cloud; needs the reference.
};

/// A walk around a block of corridors, a different corner and length for each robot.
inline Pose3 example_pose(std::size_t robot, double distance_m) {
  const double width = 34.0 - 5.0 * static_cast<double>(robot);
  const double height = 18.0 + 3.0 * static_cast<double>(robot);
  const double side[4] = {width, height, width, height};
  double left = std::fmod(distance_m + 13.0 * static_cast<double>(robot), 2.0 * (width + height));
  Eigen::Vector3d p(6.0 * static_cast<double>(robot), 2.0 * static_cast<double>(robot), 0.0);
  double yaw = 0.0;
  for (const double length : side) {
    const double step = std::min(left, length);
    p += step * Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0.0);
    left -= step;
    if (left <= 0.0) break;
    yaw += M_PI / 2.0;
  }
  p += Eigen::Vector3d(0.35 * std::sin(0.31 * distance_m), 0.35 * std::cos(0.23 * distance_m),
                       0.1 * std::sin(0.05 * distance_m));
  return {so3_exp({0.0, 0.0, yaw}), p};
}

inline Trajectory moved(const Pose3& T_a_b, const Trajectory& trajectory_b) {
  Trajectory out = trajectory_b;
  for (auto& p : out) p.pose = T_a_b * p.pose;
  return out;
}

/// The same trajectory with white noise on positions.
inline Trajectory noisy(const Trajectory& truth, double sigma_m, Rng rng) {
  Trajectory out = truth;
  for (auto& p : out)
    p.pose.translation += Eigen::Vector3d(rng.normal(sigma_m), rng.normal(sigma_m), rng.normal(sigma_m));
  return out;
}

/// Odometry with a yaw error per metre.
inline Trajectory drifting(const Trajectory& truth, double yaw_per_metre_rad) {
  Trajectory out{{truth.front().stamp, Pose3{}}};
  for (std::size_t k = 1; k < truth.size(); ++k) {
    const Pose3 step = truth[k - 1].pose.inverse() * truth[k].pose;
    const Pose3 error{so3_exp({0.0, 0.0, yaw_per_metre_rad * step.translation.norm()}), Eigen::Vector3d::Zero()};
    out.push_back({truth[k].stamp, out.back().pose * step * error});
  }
  return out;
}

inline Pose3 example_T_world_truth() { return {so3_exp({0.01, 0.02, 0.4}), {5.0, -3.0, 1.0}}; }

/// Two walls along a trajectory.
inline PointCloud example_walls(const Trajectory& trajectory, Rng rng) {
  PointCloud out;
  for (const auto& p : trajectory)
    for (int i = 0; i < 60; ++i)
      out.points.push_back(
          (p.pose * Eigen::Vector3d(rng.uniform(-1.5, 1.5), i % 2 == 0 ? 1.6 : -1.6, rng.uniform(-1.0, 1.5)))
              .cast<float>());
  return out;
}

inline RobotRecord example_robot(std::size_t index, const ExampleOptions& options, const Rng& rng) {
  static const char* const kNames[] = {"alpha", "bravo", "charlie", "delta"};
  RobotRecord robot{.id = {static_cast<std::uint32_t>(index)}};
  robot.name = index < 4 ? kNames[index] : fmt::format("robot{}", index);
  Trajectory truth;
  for (std::size_t k = 0; k < options.keyframes; ++k) {
    const double time_s = 2.0 * static_cast<double>(k);
    truth.push_back({Timestamp{1'700'000'000'000'000'000} + time_s, example_pose(index, 0.7 * time_s)});
  }
  robot.odometry = drifting(truth, index % 2 == 0 ? 0.0015 : -0.002);
  robot.server_estimate = moved(example_T_world_truth(), noisy(truth, 0.01, rng.fork("server")));
  robot.mapped_share = 1.0;
  if (options.reference) robot.reference = truth;
  robot.duration_s = truth.empty() ? 0.0 : truth.back().stamp - truth.front().stamp;
  robot.distance_m = 0.7 * robot.duration_s;
  robot.odometry_factors = options.keyframes - 1;
  robot.keyframes = options.keyframes;
  robot.submaps = options.keyframes / 5;
  robot.proxy_nodes = options.keyframes;
  robot.bytes_up = 812'345 + 1000 * index;
  robot.bytes_down = 91'234;
  robot.traffic = {{.from = robot.name,
                    .to = "server",
                    .kind = "submap",
                    .messages = 12,
                    .bytes = robot.bytes_up,
                    .transmitted_bytes = robot.bytes_up,
                    .bytes_per_s = 6750.0,
                    .largest_message = 81'234},
                   {.from = "server",
                    .to = robot.name,
                    .kind = "proxy graph",
                    .messages = 11,
                    .bytes = 91'234,
                    .transmitted_bytes = 90'000,
                    .bytes_per_s = 760.0,
                    .largest_message = 9'876}};
  robot.messages_up = robot.submaps;
  robot.messages_down = 24;
  const double quality[] = {0.055, 0.03, 0.02, 0.018, 0.04, 0.09};
  const char* const names[] = {"every_node", "every_node_2", "spectral", "uniform", "random", "skeleton"};
  for (std::size_t p = 0; p < 6; ++p) {
    PolicyRecord policy{.name = names[p]};
    const Pose3 T_map_truth = robot.odometry.front().pose * truth.front().pose.inverse();
    policy.corrected = moved(T_map_truth, noisy(truth, quality[p], rng.fork(p)));
    policy.constraints_added = p == 0 ? options.keyframes - 1 : p == 1 ? 2 * options.keyframes - 3 : 24;
    if (options.reference)
      policy.accuracy = {quality[p] * 1.7, quality[p] * 4.0, quality[p] * 0.8, 0.11, quality[p] * 1.1, 0.3, 1.0};
    policy.discontinuity = evaluation::Discontinuity{0.5 * quality[p], 20.0 * quality[p], {}, {}};
    policy.agreement_rmse_m = quality[p];
    if (p == 2)
      for (std::size_t k = 0; k + 12 < options.keyframes; k += 6)
        policy.constraints.push_back({truth[k].stamp,
                                      truth[k + (k % 4 == 0   ? 12
                                                 : k % 3 == 0 ? 5
                                                              : 1)]
                                          .stamp,
                                      static_cast<consistency::ConstraintKind>(k % 4 == 0   ? 2
                                                                               : k % 3 == 0 ? 1
                                                                                            : 0)});
    robot.policies.push_back(std::move(policy));
  }
  if (options.reference) {
    robot.onboard = {0.712 + 0.1 * static_cast<double>(index), 1.4, 0.021, 0.12, 0.095, 0.41, 1.0};
    robot.server = {0.0173, 0.05, 0.024, 0.13, 0.026, 0.14, 1.0};
  }
  for (std::uint64_t u = 1; 20.0 * static_cast<double>(u) <= robot.duration_s; ++u)
    robot.updates.push_back({.time_s = 20.0 * static_cast<double>(u), .revision = u});
  return robot;
}

inline ServerRecord example_server(const std::vector<RobotRecord>& robots, const ExampleOptions& options, Rng rng) {
  ServerRecord server{.components = robots.empty() ? 0U : 1U};
  if (options.reference && !robots.empty()) {
    server.joint = {.rmse_m = 0.0182, .max_error_m = 0.061, .rpe_m = 0.024, .scored_share = 1.0};
    server.T_reference_world = example_T_world_truth().inverse();
  }
  for (const auto& robot : robots) {
    for (std::uint32_t k = 0; k < robot.server_estimate.size(); ++k) {
      const auto& [stamp, pose] = robot.server_estimate[k];
      server.nodes.push_back({{robot.id, k}, stamp});
      server.graph.poses.push_back(pose);
      server.proxy.nodes.push_back({.chain = robot.id, .stamp = stamp, .T_world_body = pose});
      if (k > 0) {
        const std::size_t to = server.graph.poses.size() - 1;
        server.graph.edges.push_back({to - 1, to, server.graph.poses[to - 1].inverse() * pose});
      }
    }
    if (options.cloud)
      server.clouds.push_back({robot.id, example_walls(robot.server_estimate, rng.fork(robot.name)), {}});
    server.proxy.components.push_back({robot.id, 0});
  }
  server.proxy.revision = 24;
  const std::size_t n = server.nodes.size();
  for (std::size_t a = 0; a < n; a += 3)
    for (std::size_t b = a + 20; b < n; b += 7)
      if ((server.graph.poses[a].translation - server.graph.poses[b].translation).norm() < 3.0)
        server.closures.push_back({server.nodes[a].id, server.nodes[b].id});
  server.rejections = {{RefusalReason::overlap, 31, 55, {RefusalReason::overlap, 0.29, 0.3}},
                       {RefusalReason::free_to_slide, 4, 9, {RefusalReason::free_to_slide, 0.01, 0.02}},
                       {RefusalReason::inconsistent, 0, 3}};
  if (options.reference) server.closure_check = {server.closures.size(), 0, 0.041, 0.4};
  return server;
}

/// The walls along the references, and made-up distances of the map to them.
inline void add_example_survey(MissionRecord& record) {
  auto survey = std::make_shared<PointCloud>();
  for (auto& robot : record.robots) {
    const PointCloud walls = example_walls(robot.reference, Rng(3));
    survey->points.insert(survey->points.end(), walls.points.begin(), walls.points.end());
    robot.map_error = {evaluation::CloudDistance{7200, 0.41, 0.62, 1.31, 0.21, 0.45, 0.88},
                       evaluation::CloudDistance{7200, 0.06, 0.08, 0.15, 0.86, 0.99, 1.0}};
  }
  for (auto& seen : record.server.clouds)
    for (std::size_t i = 0; i < seen.cloud.points.size(); ++i)
      seen.distance_m.push_back(0.6F * static_cast<float>(i) / static_cast<float>(seen.cloud.points.size()));
  record.survey = survey;
  record.server.map_error = evaluation::CloudDistance{14400, 0.05, 0.07, 0.12, 0.9, 1.0, 1.0};
  record.server.survey_covered = 0.97;
}

inline double mission_time_of(const RobotRecord& robot, Timestamp stamp) {
  return robot.start_s + (stamp - robot.odometry.front().stamp);
}

/// As a mission that compares no policies records it.
inline void keep_the_default_policy(MissionRecord& record) {
  const auto other = [&](const std::string& policy) { return policy != record.default_policy; };
  for (RobotRecord& robot : record.robots)
    std::erase_if(robot.policies, [&](const PolicyRecord& policy) { return other(policy.name); });
  std::erase_if(record.timing.policies, [&](const PolicyTiming& timing) { return other(timing.policy); });
}

inline MissionRecord example_record(ExampleOptions options = {}) {
  options.cloud = options.cloud || options.survey;
  const Rng rng(7);
  MissionRecord record{.mission = "example", .description = "A made-up mission to look at the report"};
  record.input = "simulated";
  record.notes = {"Everything on this page is made up: it shows the layout, nothing else.",
                  "Loop closures are the true relative poses with noise; one in ten is wrong on purpose."};
  record.seed = 7;
  record.default_policy = "spectral";
  record.duration_s = 2.0 * static_cast<double>(options.keyframes);
  record.rpe_interval = "10 m";
  record.version = "0.1.0";
  record.effective_config_yaml = "mission: example\nseed: 7\npolicy:\n  name: spectral\n";
  for (std::size_t r = 0; r < options.robots; ++r)
    record.robots.push_back(example_robot(r, options, rng.fork(fmt::format("robot{}", r))));
  for (auto& robot : record.robots)
    for (const auto& other : record.robots)
      if (other.id != robot.id)
        robot.whereabouts.push_back(
            {other.id, other.odometry.back().stamp,
             robot.policies[2].corrected.back().pose * robot.server_estimate.back().pose.inverse() *
                 other.server_estimate.back().pose});
  for (auto& robot : record.robots) {
    if (options.cloud) robot.onboard_cloud = example_walls(robot.odometry, rng.fork("onboard"));
    if (robot.odometry.size() < 40) continue;
    const auto stamp = [&](std::size_t k) { return robot.odometry[k].stamp; };
    robot.drift_origins = {{DriftOrigin::Kind::slip, stamp(10), stamp(11), 0.21, 0.02},
                           {DriftOrigin::Kind::degeneracy, stamp(18), stamp(24), 0.8, 0.0},
                           {DriftOrigin::Kind::failure, stamp(30), stamp(36), 1.9, 0.3}};
    robot.explanation = example_explanation(robot.server_estimate, {{.from = stamp(17),
                                                                     .until = stamp(25),
                                                                     .scale = 3,
                                                                     .length_m = 11.2,
                                                                     .translation_m = 0.78,
                                                                     .rotation_rad = 0.01,
                                                                     .significance = 2.4},
                                                                    {.from = stamp(31),
                                                                     .until = stamp(36),
                                                                     .place_m = {12.34, -4.02, -0.01},
                                                                     .scale = 4,
                                                                     .length_m = 7.0,
                                                                     .translation_m = 1.87,
                                                                     .rotation_rad = 0.31,
                                                                     .significance = 8.7,
                                                                     .alert = true}});
    for (auto& update : robot.updates)
      for (const auto& origin : robot.explanation->origins)
        if (mission_time_of(robot, origin.until) + 30.0 < update.time_s) update.origins.push_back(origin);
    robot.alerts = alerts_of(robot.updates);
  }
  record.server = example_server(record.robots, options, rng.fork("cloud"));
  if (options.survey) add_example_survey(record);
  for (std::size_t r = 1; r < record.robots.size(); ++r)
    record.transforms.push_back({record.robots[0].name, record.robots[r].name,
                                 Pose3{so3_exp({0.02, 0.01, 2.1}), {31.2, -17.4, 0.3}}, 0.012, 0.05});
  record.timing.machine = "made-up machine";
  record.timing.wall_s = 12.3;
  for (const auto& robot : record.robots)
    for (const auto& policy : robot.policies)
      record.timing.policies.push_back({robot.name, policy.name, {9.1, 11.2, 31.0}, {5.0, 6.1, 20.0}, {3.0, 4.0, 9.0}});
  record.timing.server_updates = {{20.0, 18.0, 17.0}, {40.0, 64.0, 51.0}, {60.0, 22.0, 21.0}};
  record.timing.server_verification_ms = {11.0, 12.0, 13.0, 25.0};
  return record;
}

}  // namespace tutti::mission::test
