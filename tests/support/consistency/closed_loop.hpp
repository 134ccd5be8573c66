// SPDX-License-Identifier: BSD-3-Clause
// A robot and a server over a whole mission, on trajectory level: walk, compare, correct, walk on.
#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "support/consistency/uncertainty.hpp"
#include "tutti/base/check.hpp"
#include "tutti/consistency/policy.hpp"
#include "tutti/consistency/synchronise.hpp"
#include "tutti/estimation/onboard_smoother.hpp"
#include "tutti/geometry/alignment.hpp"

namespace tutti::consistency::test {

/// A mission, independent of how the robot reacts.
struct Mission {
  std::vector<Pose3> truth;
  std::vector<Pose3> increments;  ///< Raw odometry, node to node.
  std::vector<Pose3> server;      ///< The joint map once all closures are found.
  OdometryNoise noise;
  ServerNoise server_noise;
  /// False: the server knows its final map from the start. True: what lies after the latest revisit is odometry to the
  /// server, too.
  bool late_closures = false;
  /// True: the server starts from odometry and comes to its final map bit by bit, by 4/5 of the mission.
  bool settling = false;
};

inline Mission corridor_mission(std::size_t length, const OdometryNoise& noise, std::uint64_t seed,
                                const ServerNoise& server = {}) {
  const Rng rng(seed);
  Mission out{.truth = corridor(length), .noise = noise, .server_noise = server};
  out.increments = odometry_increments(out.truth, noise, rng.fork("odometry"));
  out.server = moved({so3_exp(Eigen::Vector3d(0, 0, 2.0)), {30, -20, 1}},
                     server_estimate(out.truth, server, rng.fork("server")));
  return out;
}

/// The server's broadcast after `count` nodes.
inline std::vector<ServerNode> server_after(const Mission& mission, std::size_t count) {
  if (mission.settling) {
    const double done = static_cast<double>(count) / (0.8 * static_cast<double>(mission.truth.size()));
    std::vector<Pose3> poses{mission.server[0]};
    while (poses.size() < count) {
      const std::size_t n = poses.size();
      const Pose3 final_step = mission.server[n - 1].inverse() * mission.server[n];
      poses.push_back(poses.back() * interpolate(mission.increments[n - 1], final_step, std::min(done, 1.0)));
    }
    return server_nodes(kAlpha, poses, covariance_of(mission.noise));
  }
  constexpr double kClosure_m = 5.0;
  constexpr std::size_t kRevisit = 60;
  std::size_t closed = mission.late_closures ? 0 : count - 1;
  for (std::size_t n = count; mission.late_closures && closed == 0 && n-- > kRevisit;)
    for (std::size_t m = 0; m + kRevisit < n; ++m)
      if ((mission.truth[n].translation - mission.truth[m].translation).norm() < kClosure_m) {
        closed = n;
        break;
      }
  std::vector<Pose3> poses(mission.server.begin(), mission.server.begin() + static_cast<std::ptrdiff_t>(closed) + 1);
  while (poses.size() < count) poses.push_back(poses.back() * mission.increments[poses.size() - 1]);
  return server_nodes(kAlpha, poses, covariance_of(mission.noise));
}

/// RMSE of the positions after the best rigid alignment, m.
inline double rmse(const std::vector<Pose3>& a, const std::vector<Pose3>& b) {
  std::vector<Eigen::Vector3d> x, y;
  for (const Pose3& pose : a) x.push_back(pose.translation);
  for (const Pose3& pose : b) y.push_back(pose.translation);
  const Pose3 T = align_points(x, y);
  double sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (x[i] - T * y[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(x.size()));
}

struct LoopConfig {
  CompareConfig compare;
  PolicyConfig policy{.name = "spectral"};
  ProxyGraphConfig proxy_graph;
  std::size_t nodes_per_update = 7;  ///< 20 s at 0.33 m/s.
  /// In place of that policy; gets the number of the update, from 0, before it chooses.
  std::function<const ConstraintPolicy&(std::size_t update)> other_policy;
};

struct LoopResult {
  std::size_t odometry_factors = 0, constraints = 0, updates = 0, replaced = 0;
  double onboard_m = 0.0;          ///< Raw odometry against the truth.
  double corrected_m = 0.0;        ///< Corrected against the truth.
  double agreement_m = 0.0;        ///< Corrected against the server, at the end.
  double worst_agreement_m = 0.0;  ///< Over all updates.
  std::vector<std::size_t> ledger_sizes;
};

inline LoopResult run_closed_loop(const Mission& mission, const LoopConfig& config) {
  constexpr std::size_t kSteps = 3;  // odometry factors per node
  const auto of_config = make_policy(config.policy, config.compare);
  TUTTI_CHECK(of_config.has_value(), "{}", of_config.error().message);
  estimation::OnboardSmoother smoother;
  Ledger ledger;
  LoopResult out;
  const auto estimate = [&](std::size_t count) {
    std::vector<Pose3> poses;
    for (std::size_t n = 0; n < count; ++n) poses.push_back(smoother.pose(kSteps * n));
    return poses;
  };
  const std::size_t length = mission.truth.size();
  for (std::size_t count = 1; count <= length; ++count) {
    if (count > 1) {
      Pose3 done;
      for (std::size_t step = 1; step <= kSteps; ++step) {
        const Pose3 next = interpolate({}, mission.increments[count - 2], static_cast<double>(step) / kSteps);
        smoother.append({done.inverse() * next, covariance_of(mission.noise) / kSteps});
        done = next;
      }
    }
    if (count % config.nodes_per_update != 0 && count != length) continue;
    auto graph = build_proxy_graph(++out.updates, server_after(mission, count), {{kAlpha, 0}}, config.proxy_graph);
    if (!mission.settling && !mission.late_closures && !graph.reduced)
      graph.uncertainties = {uncertainty_by(mission.server_noise, graph, kAlpha)};
    const auto nodes = robot_nodes(estimate(count), mission.increments);
    const auto pairs = synchronise(graph, kAlpha, nodes).pairs;
    const ConstraintPolicy& policy = config.other_policy ? config.other_policy(out.updates - 1) : **of_config;
    std::optional<DisagreementTest> test;
    Disagreement found;
    if (pairs.size() >= 2) {
      test.emplace(graph, kAlpha, pairs, DisagreementConfig().for_run_of(pairs.size()));
      found = (*test)(odometry_at(nodes, pairs));
    }
    const auto selection = policy.choose({graph, kAlpha, nodes, pairs, ledger, test ? &*test : nullptr, &found});
    out.replaced += ledger.update(selection.constraints, selection.replaces_all).replaced;
    std::vector<estimation::ChainConstraint> constraints;
    for (const Constraint& c : ledger.constraints()) constraints.push_back({c.from, c.to, c.measurement});
    smoother.set_constraints(std::move(constraints));
    smoother.solve();
    out.ledger_sizes.push_back(ledger.size());
    std::vector<Pose3> server;
    for (const ServerNode& node : server_after(mission, count)) server.push_back(node.T_world_body);
    out.agreement_m = rmse(server, estimate(count));
    out.worst_agreement_m = std::max(out.worst_agreement_m, out.agreement_m);
  }
  out.odometry_factors = kSteps * (length - 1);
  out.constraints = ledger.size();
  out.onboard_m = rmse(mission.truth, integrate({}, mission.increments));
  out.corrected_m = rmse(mission.truth, estimate(length));
  return out;
}

}  // namespace tutti::consistency::test
