// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/chain_run.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <vector>

#include "support/estimation/random_graphs.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::estimation::internal {
namespace chain_run_test {

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

RC_GTEST_PROP(ChainRun, SumsAboutRawOdometryAgree, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Run run = any_run(rng);
  const RunSum raw = sum_odometry(run.steps);
  const RunSum about = sum_about(run.steps, run.poses);
  RC_ASSERT((raw.covariance - about.covariance).norm() < 1e-9 * raw.covariance.norm());
  RC_ASSERT(about.offset.norm() < 1e-10);
  RC_ASSERT(local(raw.T_a_b, about.T_a_b).norm() < 1e-10);
}

/// Two computations of the same poses, from gaps of a micrometre to gaps of a metre and a radian.
RC_GTEST_PROP(ChainRun, BendingRawOdometryIsBendingAboutIt, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  const Run run = any_run(rng);
  const double size = std::pow(10.0, rng.uniform(-6.0, 0.0));
  const Vector6d gap = random_tangent(rng, size, size);
  std::vector<Pose3> raw = run.poses;
  raw.back() = retract(raw.back(), gap);
  std::vector<Pose3> about = run.poses;
  const RunSum sum = sum_odometry(run.steps);
  distribute_odometry(run.steps, as_edge(sum, 0, 1), raw);
  distribute_about(run.steps, sum, Vector6d::Zero(), gap, about);
  about.back() = raw.back();  // left to the caller
  RC_ASSERT(largest_position_difference(raw, about) < 1e-7 * (1.0 + size * run.poses.back().translation.norm()));
  RC_ASSERT(largest_rotation_difference(raw, about) < 1e-7);
}

/// The steps share the gap: carried on to the last step, the bend arrives where the gap closes.
RC_GTEST_PROP(ChainRun, TheBendClosesTheGap, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Run run = any_run(rng);
  run.steps.push_back({Pose3{}, Matrix6d::Zero()});  // a step without uncertainty: its begin moves as the end does
  run.poses.push_back(run.poses.back());
  const Vector6d gap = random_tangent(rng, 1e-3, 1e-3);
  std::vector<Pose3> bent = run.poses;
  bent.back() = retract(bent.back(), gap);
  distribute_odometry(run.steps, as_edge(sum_odometry(run.steps), 0, 1), bent);
  const std::size_t last = bent.size() - 2;
  RC_ASSERT((local(run.poses[last], bent[last]) - gap).norm() < 1e-8);
}

/// Linearised where the run is, the edge has its gradient and its Hessian.
RC_GTEST_PROP(ChainRun, AsAnEdgeItIsTheSame, ()) {
  Rng rng(*rc::gen::arbitrary<std::uint32_t>());
  Run run = any_run(rng);
  for (Pose3& pose : run.poses) pose = retract(pose, random_tangent(rng, 0.05, 0.05));
  const RunSum sum = sum_about(run.steps, run.poses);
  const PoseGraphEdge edge = as_edge(sum, 3, 7);
  const auto linear = linearise_between(run.poses.front(), run.poses.back(), edge.T_from_to);
  const Matrix6d W = inverse_of(sum.covariance);
  const Matrix6d A = adjoint(sum.T_a_b);  // the run's Jacobians are -1 and A, its residual -offset
  const Vector6d force = edge.information * linear.residual;
  const auto near = [](const auto& a, const auto& b) { return (a - b).norm() < 1e-8 * (1.0 + b.norm()); };
  RC_ASSERT(edge.from == 3U && edge.to == 7U);
  RC_ASSERT(near(Matrix6d(linear.J_i.transpose() * edge.information * linear.J_i), W));
  RC_ASSERT(near(Matrix6d(linear.J_j.transpose() * edge.information * linear.J_j), Matrix6d(A.transpose() * W * A)));
  RC_ASSERT(near(Matrix6d(linear.J_i.transpose() * edge.information * linear.J_j), Matrix6d(-W * A)));
  RC_ASSERT(near(Vector6d(linear.J_i.transpose() * force), Vector6d(W * sum.offset)));
  RC_ASSERT(near(Vector6d(linear.J_j.transpose() * force), Vector6d(-A.transpose() * W * sum.offset)));
}

}  // namespace chain_run_test
}  // namespace tutti::estimation::internal
