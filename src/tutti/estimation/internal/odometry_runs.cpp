// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/internal/odometry_runs.hpp"

#include <Eigen/Cholesky>

#include "tutti/estimation/internal/chain_run.hpp"
#include "tutti/model/way.hpp"

namespace tutti::estimation::internal {
namespace {

constexpr double kBendTolerance_m = 1e-6;

OdometryRun compound(std::size_t begin, std::size_t end, std::span<const RelativePose> odometry) {
  const auto steps = odometry.subspan(begin, end - begin);
  const RunSum sum = sum_odometry(steps);
  const Matrix6d to_end = adjoint(sum.T_a_b.inverse());
  const Matrix6d covariance = to_end * sum.covariance * to_end.transpose();
  return {.begin = begin,
          .end = end,
          .T_begin_end = sum.T_a_b,
          .information = covariance.llt().solve(Matrix6d::Identity()),
          .length_m = way_m(steps)};
}

bool same_shape(const OdometryRun& run, const Vector6d& closing) {
  if (!run.bent) return false;
  const Vector6d change = closing - *run.bent;
  return change.head<3>().norm() + run.length_m * change.tail<3>().norm() <= kBendTolerance_m;
}

}  // namespace

std::size_t OdometryRuns::update(std::span<const std::size_t> nodes, std::span<const RelativePose> odometry) {
  std::vector<OdometryRun> runs;
  runs.reserve(nodes.size());
  std::size_t compounded = 0;
  auto old = runs_.begin();
  for (std::size_t k = 0; k + 1 < nodes.size(); ++k) {
    while (old != runs_.end() && old->begin < nodes[k]) ++old;
    if (old != runs_.end() && old->begin == nodes[k] && old->end == nodes[k + 1]) {
      runs.push_back(*old);
    } else {
      runs.push_back(compound(nodes[k], nodes[k + 1], odometry));
      compounded += nodes[k + 1] - nodes[k];
    }
  }
  runs_ = std::move(runs);
  return compounded;
}

std::size_t OdometryRuns::place(std::span<const Pose3> nodes, std::span<const RelativePose> odometry,
                                std::span<Pose3> poses) {
  std::size_t bent = 0;
  for (std::size_t k = 0; k < runs_.size(); ++k) {
    OdometryRun& run = runs_[k];
    const std::size_t steps = run.end - run.begin;
    const Pose3 before = poses[run.begin];
    poses[run.begin] = nodes[k];
    const Vector6d closing = local(nodes[k] * run.T_begin_end, nodes[k + 1]);
    if (same_shape(run, closing)) {
      const Pose3 motion = nodes[k] * before.inverse();
      for (Pose3& pose : poses.subspan(run.begin + 1, steps - 1)) pose = motion * pose;
      continue;
    }
    // The multiplier of "the steps' errors add up to the closing", in the tangent of the begin.
    const Vector6d lambda = adjoint(run.T_begin_end.inverse()).transpose() * (run.information * closing);
    distribute_odometry(odometry.subspan(run.begin, steps), poses.subspan(run.begin, steps + 1), lambda);
    run.bent = closing;
    bent += steps - 1;
  }
  poses[runs_.empty() ? 0 : runs_.back().end] = nodes.back();
  return bent;
}

void OdometryRuns::forget_bends() {
  for (OdometryRun& run : runs_) run.bent.reset();
}

}  // namespace tutti::estimation::internal
