// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/chain_run.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "tutti/estimation/testing/random_graphs.hpp"

namespace tutti::estimation::internal {
namespace {

using namespace testing;

struct Run {
  std::vector<RelativePose> steps;
  std::vector<Pose3> poses;  ///< Composed.
};

Run any_run(Rng& rng) {
  Run run{.steps = {}, .poses = {random_pose(rng, 50.0, 2.0)}};
  for (std::size_t k = 2 + rng.index(80); k > 0; --k) {
    run.steps.push_back({random_pose(rng, 0.1, 0.05), random_covariance(rng, 1e-2, 3e-3)});
    run.poses.push_back(run.poses.back() * run.steps.back().T_a_b);
  }
  return run;
}

/// The multiplier that closes a gap of about this size in the tangent of the run's begin.
Vector6d closing(Rng& rng, const RunSum& sum, double size) {
  return sum.covariance.llt().solve(random_tangent(rng, size, size));
}

RC_GTEST_PROP(ChainRun, SumsAboutRawOdometryAgree, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Run run = any_run(rng);
  const RunSum raw = sum_odometry(run.steps);
  const RunSum about = sum_about(run.steps, run.poses);
  RC_ASSERT((raw.covariance - about.covariance).norm() < 1e-9 * raw.covariance.norm());
  RC_ASSERT(about.offset.norm() < 1e-10);
  RC_ASSERT(local(raw.T_a_b, about.T_a_b).norm() < 1e-10);
}

/// Two ways to the same poses, from gaps of a micrometre to gaps of a metre and a radian.
RC_GTEST_PROP(ChainRun, BendingRawOdometryIsBendingAboutIt, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Run run = any_run(rng);
  const Vector6d lambda = closing(rng, sum_odometry(run.steps), std::pow(10.0, rng.uniform(-6.0, 0.0)));
  std::vector<Pose3> raw = run.poses;
  std::vector<Pose3> about = run.poses;
  distribute_odometry(run.steps, raw, lambda);
  distribute_about(run.steps, about, Vector6d::Zero(), lambda);
  RC_ASSERT(largest_position_difference(raw, about) < 1e-9);
  RC_ASSERT(largest_rotation_difference(raw, about) < 1e-9);
}

/// The steps share the gap: carried on to the last step, the bend arrives where the gap closes.
RC_GTEST_PROP(ChainRun, TheBendClosesTheGap, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Run run = any_run(rng);
  const Vector6d gap = random_tangent(rng, 1e-3, 1e-3);
  run.steps.push_back({Pose3{}, Matrix6d::Zero()});  // a step without uncertainty: its begin moves as the end does
  run.poses.push_back(run.poses.back());
  const Vector6d lambda = sum_odometry(run.steps).covariance.llt().solve(gap);
  std::vector<Pose3> bent = run.poses;
  distribute_odometry(run.steps, bent, lambda);
  const std::size_t last = bent.size() - 2;
  const Pose3 T_a_last = run.poses.front().inverse() * run.poses[last];
  const Vector6d moved = adjoint(T_a_last) * local(run.poses[last], bent[last]);
  RC_ASSERT((moved - gap).norm() < 1e-9);
}

}  // namespace
}  // namespace tutti::estimation::internal
