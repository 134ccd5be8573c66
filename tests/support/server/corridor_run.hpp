// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/alignment.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/server/map_estimate.hpp"
#include "tutti/simulation/odometry.hpp"
#include "tutti/simulation/reference_closures.hpp"
#include "tutti/simulation/trajectory.hpp"

/// Robots in a corridor network with odometry that fails, closures of which some are wrong, and the truth.
namespace tutti::server::test {

/// Odometry that errs without knowing: `jump` [m; rad] is spread evenly over from .. until (one increment: a slip).
struct Failure {
  RobotId robot;
  double from_s = 0.0;
  double until_s = 0.0;
  Vector6d jump = Vector6d::Zero();
};

inline Failure failure(std::uint32_t robot, double from_s, double until_s, double x_m, double y_m, double yaw_deg) {
  Failure out{{robot}, from_s, until_s};
  out.jump << x_m, y_m, 0.0, 0.0, 0.0, yaw_deg * kRadPerDeg;
  return out;
}

/// Two similar segments of the trajectory: every pair of submaps there gives a closure that puts the second segment
/// onto the first, all agreeing with each other, all wrong.
struct LookAlike {
  RobotId first;
  double first_from_s = 0.0;
  RobotId second;
  double second_from_s = 0.0;
  double length_s = 30.0;
};

struct CorridorRunConfig {
  std::uint32_t robots = 2;
  simulation::CorridorWorldConfig world{.rows = 2, .columns = 3, .block_m = 15.0, .jitter_m = 3.0};
  simulation::WalkConfig walk{.duration_s = 400.0, .rate_hz = 4.0};
  simulation::OdometryNoiseConfig odometry;
  simulation::ReferenceClosureConfig closures{.radius_m = 2.0, .wrong_share = 0.0};
  std::vector<Failure> failures;
  std::vector<Failure> blind;  ///< Segments (robot, from, until) without closures.
  std::vector<LookAlike> look_alikes;
  double keyframe_m = 0.8;
};

struct CorridorRun {
  std::map<RobotId, Trajectory> truth;
  std::map<KeyframeId, Pose3> true_poses;
  SubmapSet submaps;
  VerdictSet verdicts;
};

inline void fail_odometry(Trajectory& odometry, const Failure& failure) {
  const auto seconds = [&](std::size_t k) { return odometry[k].stamp - odometry.front().stamp; };
  std::vector<std::size_t> steps;
  for (std::size_t k = 1; k < odometry.size(); ++k)
    if (seconds(k) > failure.from_s && (steps.empty() || seconds(k) <= failure.until_s)) steps.push_back(k);
  if (steps.empty()) return;
  const Trajectory before = odometry;
  for (std::size_t k = steps.front(); k < odometry.size(); ++k) {
    Pose3 step = before[k - 1].pose.inverse() * before[k].pose;
    if (k <= steps.back()) step = retract(step, failure.jump / static_cast<double>(steps.size()));
    odometry[k].pose = odometry[k - 1].pose * step;
  }
}

/// Adds the closures of `look_alikes`, in place of any true ones of these pairs.
inline void add_look_alikes(CorridorRun& run, const CorridorRunConfig& config, Rng rng) {
  const auto truth_at = [&](RobotId robot, Timestamp stamp) {
    const Trajectory& truth = run.truth.at(robot);
    return std::ranges::lower_bound(truth, stamp, {}, &StampedPose::stamp)->pose;
  };
  const auto seconds = [](Timestamp stamp) { return stamp - Timestamp{1'000'000'000}; };
  const auto stamp_of = [](double s) { return Timestamp{1'000'000'000 + static_cast<std::int64_t>(1e9 * s)}; };
  for (const LookAlike& alike : config.look_alikes) {
    const Pose3 moved = truth_at(alike.first, stamp_of(alike.first_from_s)) *
                        truth_at(alike.second, stamp_of(alike.second_from_s)).inverse();
    const auto within = [&](const SubmapId& id, const Keyframe& k, RobotId robot, double from_s) {
      return id.chain.robot == robot && seconds(k.stamp) >= from_s && seconds(k.stamp) <= from_s + alike.length_s;
    };
    for (const auto& [a, one] : run.submaps)
      for (const auto& [b, other] : run.submaps) {
        const Keyframe& i = one->keyframes[one->keyframes.size() / 2];
        const Keyframe& j = other->keyframes[other->keyframes.size() / 2];
        if (a >= b || !within(a, i, alike.first, alike.first_from_s) ||
            !within(b, j, alike.second, alike.second_from_s))
          continue;
        Vector6d noise;
        for (double& n : noise) n = rng.normal(0.01);
        const Pose3 T = truth_at(a.chain.robot, i.stamp).inverse() * moved * truth_at(b.chain.robot, j.stamp);
        Vector6d variance = Vector6d::Constant(1e-4);
        run.verdicts[{a, b}] = {
            {a, b}, {{{a.chain, i.index}, {b.chain, j.index}, {retract(T, noise), variance.asDiagonal()}}}, {}};
      }
  }
}

inline CorridorRun corridor_run(const CorridorRunConfig& config, std::uint64_t seed) {
  CorridorRun run;
  const Rng rng(seed);
  const auto world = simulation::make_corridor_world(config.world, rng.fork("world"));
  const auto starts = simulation::spread_starts(world, config.robots, rng.fork("starts"));
  for (std::uint32_t r = 0; r < config.robots; ++r) {
    const RobotId robot{r};
    const Rng own = rng.fork(r);
    const Trajectory truth =
        simulation::simulate_walk(world, config.walk, {1'000'000'000}, starts[r], own.fork("walk"));
    auto simulated = simulation::simulate_odometry(truth, {}, config.odometry, own.fork("odometry"));
    for (const Failure& f : config.failures)
      if (f.robot == robot) fail_odometry(simulated.odometry, f);
    std::vector<RelativePose> steps;
    Submap open{.id = {robot, 0}};
    RelativePose since{.T_a_b = {}, .covariance = Matrix6d::Zero()};
    std::uint32_t index = 0;
    for (std::size_t k = 0; k < truth.size(); ++k) {
      if (k > 0) {
        const Pose3 step = simulated.odometry[k - 1].pose.inverse() * simulated.odometry[k].pose;
        since = compound(since, {step, simulated.increment_covariance[k - 1]});
        if (since.T_a_b.translation.norm() < config.keyframe_m) continue;
        open.odometry.push_back(since);
        since = {.T_a_b = {}, .covariance = Matrix6d::Zero()};
      }
      open.keyframes.push_back({index++, truth[k].stamp, simulated.odometry[k].pose, index % 2 == 0});
      run.true_poses[{robot, open.keyframes.back().index}] = truth[k].pose;
      if (open.keyframes.back().stamp - open.keyframes.front().stamp < 10.0) continue;
      run.submaps[open.id] = std::make_shared<const Submap>(open);
      open = {.id = {robot, open.id.index + 1}, .keyframes = {open.keyframes.back()}};
    }
    if (open.keyframes.size() > 1) run.submaps[open.id] = std::make_shared<const Submap>(open);
    run.truth[robot] = truth;
  }
  const simulation::ReferenceClosures verifier(run.truth, config.closures, seed);
  const auto is_blind = [&](const Submap& submap) {
    return std::ranges::any_of(config.blind, [&](const Failure& f) {
      return f.robot == submap.id.chain.robot && submap.keyframes.back().stamp - Timestamp{1'000'000'000} > f.from_s &&
             submap.keyframes.front().stamp - Timestamp{1'000'000'000} < f.until_s;
    });
  };
  for (auto a = run.submaps.begin(); a != run.submaps.end(); ++a)
    for (auto b = std::next(a); b != run.submaps.end(); ++b) {
      if (is_blind(*a->second) || is_blind(*b->second)) continue;
      ClosureVerdict verdict = verifier.verify(*a->second, *b->second);
      if (!verdict.closures.empty()) run.verdicts[verdict.pair] = std::move(verdict);
    }
  add_look_alikes(run, config, rng.fork("alike"));
  return run;
}

/// Joint RMSE of all keyframes, after one alignment.
inline double rmse(const CorridorRun& run, const MapEstimate& map, std::optional<RobotId> only = {}) {
  std::vector<Eigen::Vector3d> truth;
  std::vector<Eigen::Vector3d> estimate;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    if (only && map.nodes[i].id.chain.robot != *only) continue;
    truth.push_back(run.true_poses.at(map.nodes[i].id).translation);
    estimate.push_back(map.nodes[i].T_world_body.translation);
  }
  const Pose3 T = align_points(truth, estimate);
  double sum = 0.0;
  for (std::size_t i = 0; i < truth.size(); ++i) sum += (truth[i] - T * estimate[i]).squaredNorm();
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

inline bool is_wrong(const CorridorRun& run, const LoopClosure& closure) {
  const Pose3 truth = run.true_poses.at(closure.from).inverse() * run.true_poses.at(closure.to);
  return local(truth, closure.measurement.T_a_b).head<3>().norm() > 0.5;
}

}  // namespace tutti::server::test
