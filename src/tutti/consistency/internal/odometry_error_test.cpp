// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/odometry_error.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <set>

#include "support/random_pose.hpp"
#include "tutti/consistency/testing/runs.hpp"
#include "tutti/estimation/onboard_smoother.hpp"

namespace tutti::consistency::internal {
namespace {

constexpr double kLever_m = 0.7;

struct NoisyRun {
  std::vector<Pose3> server;
  std::vector<RelativePose> odometry;
  [[nodiscard]] OdometryError error() const { return {server, odometry, kLever_m}; }
  [[nodiscard]] std::size_t size() const { return server.size(); }
};

/// Corridors, every step off by its own full covariance, times `noise`; the first pose anywhere.
NoisyRun random_run(std::size_t nodes, std::uint64_t seed, double noise) {
  Rng rng(seed);
  const Pose3 start = tutti::test::random_pose(rng, 20.0);
  NoisyRun out{.server = test::moved(start, test::corridor(nodes))};
  for (std::size_t k = 0; k < nodes; ++k) {
    RelativePose step{.covariance = tutti::test::random_covariance(rng, noise)};
    if (k > 0) {
      const Vector6d off = step.covariance.llt().matrixL() * tutti::test::random_tangent(rng);
      step.T_a_b = retract(out.server[k - 1].inverse() * out.server[k], off);
    }
    out.odometry.push_back(step);
  }
  return out;
}

/// Where the onboard smoother puts the nodes when `held` are constrained, tightly, to lie where `at` says; all seen
/// from the first of them. [position; rotation] off the server's map, in its axes.
Eigen::MatrixXd smoothed(const NoisyRun& run, const std::vector<std::size_t>& held, const std::vector<Pose3>& at) {
  estimation::OnboardSmootherConfig config;
  config.polishing_steps = 0;
  estimation::OnboardSmoother smoother(config);
  for (std::size_t k = 1; k < run.size(); ++k) smoother.append(run.odometry[k]);
  std::vector<estimation::ChainConstraint> links;
  for (std::size_t j = 1; j < held.size(); ++j)
    links.push_back({held[j - 1], held[j], {at[j - 1].inverse() * at[j], 1e-16 * Matrix6d::Identity()}});
  smoother.set_constraints(links);
  smoother.solve();
  const Pose3 T = at[0] * smoother.pose(held[0]).inverse();
  Eigen::MatrixXd out(run.size(), 6);
  for (std::size_t k = 0; k < run.size(); ++k) {
    const Pose3 pose = T * smoother.pose(k);
    out.row(static_cast<Eigen::Index>(k)) << (pose.translation - run.server[k].translation).transpose(),
        so3_log(pose.rotation * run.server[k].rotation.conjugate()).transpose();
  }
  return out;
}

double squared(const Eigen::MatrixXd& rows) {
  return rows.leftCols<3>().squaredNorm() + kLever_m * kLever_m * rows.rightCols<3>().squaredNorm();
}
double squared(const Eigen::MatrixXd& rows, std::size_t first, std::size_t last) {  // [first, last]
  return last < first
             ? 0.0
             : squared(rows.middleRows(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(last - first + 1)));
}

bool near(double a, double b, double tolerance) { return std::abs(a - b) <= tolerance; }

/// Sorted, all different.
std::vector<std::size_t> some_nodes(std::size_t nodes, std::size_t count, Rng& rng) {
  std::set<std::size_t> out;
  while (out.size() < count) out.insert(rng.index(nodes));
  return {out.begin(), out.end()};
}

std::vector<Pose3> poses_at(const NoisyRun& run, const std::vector<std::size_t>& held) {
  std::vector<Pose3> out;
  for (const std::size_t k : held) out.push_back(run.server[k]);
  return out;
}

// For small errors the first order is all there is.
RC_GTEST_PROP(OdometryError, TheBridgeIsTheOnboardSmoothers, (std::uint64_t seed)) {
  Rng rng(seed);
  const NoisyRun run = random_run(60, seed, 1e-5);
  const auto held = some_nodes(60, 1 + rng.index(5), rng);
  const Eigen::MatrixXd expected = smoothed(run, held, poses_at(run, held));
  const Eigen::MatrixXd residual = run.error().residual(held, {});
  RC_ASSERT(expected.norm() > 1e-4);
  RC_ASSERT((residual - expected).cwiseAbs().maxCoeff() < 1e-2 * expected.cwiseAbs().maxCoeff());
}

// The same with the joints held beside the server's map: the smoother is told so in poses.
RC_GTEST_PROP(OdometryError, OffsetsMoveTheJointsAndBendTheRunsBetween, (std::uint64_t seed)) {
  Rng rng(seed);
  const NoisyRun run = random_run(60, seed, 1e-5);
  const OdometryError error = run.error();
  const auto held = some_nodes(60, 2 + rng.index(4), rng);
  std::vector<Vector6d> offsets;
  std::vector<Pose3> at;
  for (const std::size_t k : held) {
    offsets.push_back(tutti::test::random_tangent(rng, 1e-5));
    const Vector6d by = error.at_node(k, offsets.back());
    at.push_back({so3_exp(by.tail<3>()) * run.server[k].rotation, run.server[k].translation + by.head<3>()});
  }
  const Eigen::MatrixXd expected = smoothed(run, held, at), residual = error.residual(held, offsets);
  RC_ASSERT((residual - expected).cwiseAbs().maxCoeff() < 1e-2 * expected.cwiseAbs().maxCoeff());
  RC_ASSERT((residual - error.residual(held, {})).norm() > 1e-5);
}

RC_GTEST_PROP(OdometryError, SumsOverStretchesAreThoseOverTheirNodes, (std::uint64_t seed)) {
  Rng rng(seed);
  const NoisyRun run = random_run(80, seed, 1e-3);
  const OdometryError error = run.error();
  const auto ends = some_nodes(80, 3, rng);
  const std::size_t a = ends[0], b = ends[1], c = ends[2];
  const double tolerance = 1e-9 * squared(error.residual(std::vector{a}, {}));
  RC_ASSERT(near(error.bridged(a, b), squared(error.residual(std::vector{a, b}, {}), a + 1, b - 1), tolerance));
  RC_ASSERT(near(error.hanging(b, a, b), squared(error.residual(std::vector{b}, {}), a, b), tolerance));
  RC_ASSERT(near(error.hanging(b, b, c), squared(error.residual(std::vector{b}, {}), b, c), tolerance));
  RC_ASSERT(error.bridged(a, a + 1) == 0.0);
}

// What the fit minimises, from residuals alone: all nodes, the held ones twice (header).
double objective(const OdometryError& error, const std::vector<std::size_t>& held,
                 const std::vector<Vector6d>& offsets) {
  const Eigen::MatrixXd rho = error.residual(held, offsets);
  double sum = squared(rho);
  for (const std::size_t k : held) sum += squared(rho, k, k);
  return sum;
}

RC_GTEST_PROP(OdometryErrorFit, IsDenseLeastSquares, (std::uint64_t seed)) {
  Rng rng(seed);
  const NoisyRun run = random_run(40, seed, 1e-3);
  const OdometryError error = run.error();
  const auto held = some_nodes(40, 1 + rng.index(6), rng);
  const auto rows = [&](const std::vector<Vector6d>& offsets) -> Eigen::VectorXd {
    Eigen::MatrixXd rho = error.residual(held, offsets);
    const Eigen::Index n = rho.rows();
    rho.conservativeResize(n + static_cast<Eigen::Index>(held.size()), 6);
    for (std::size_t j = 0; j < held.size(); ++j)
      rho.row(n + static_cast<Eigen::Index>(j)) = rho.row(static_cast<Eigen::Index>(held[j])).eval();
    rho.rightCols<3>() *= kLever_m;
    return rho.reshaped();
  };
  std::vector<Vector6d> offsets(held.size(), Vector6d::Zero());
  const Eigen::VectorXd r = rows(offsets);
  Eigen::MatrixXd A(r.size(), 6 * static_cast<Eigen::Index>(held.size()));  // the residual is linear in the offsets
  for (Eigen::Index i = 0; i < A.cols(); ++i) {
    double& x = offsets[static_cast<std::size_t>(i / 6)](i % 6);
    x = 1.0;
    A.col(i) = rows(offsets) - r;
    x = 0.0;
  }
  const Eigen::VectorXd expected = A.colPivHouseholderQr().solve(-r);
  const auto fit = error.fit(held);
  double worst = 0.0;
  for (std::size_t j = 0; j < held.size(); ++j)
    worst = std::max(worst, (fit.offsets[j] - expected.segment<6>(6 * static_cast<Eigen::Index>(j))).norm());
  RC_ASSERT(worst < 1e-6 * expected.norm());
  RC_ASSERT(near(fit.squared_error, (A * expected + r).squaredNorm(), 1e-9 * r.squaredNorm()));
}

RC_GTEST_PROP(OdometryErrorFit, AnyOtherOffsetIsWorse, (std::uint64_t seed)) {
  Rng rng(seed);
  const NoisyRun run = random_run(100, seed, 1e-3);
  const OdometryError error = run.error();
  const auto held = some_nodes(100, 1 + rng.index(8), rng);
  const auto fit = error.fit(held);
  RC_ASSERT(near(objective(error, held, fit.offsets), fit.squared_error, 1e-9 * objective(error, held, {})));
  RC_ASSERT(fit.squared_error <= objective(error, held, {}));
  for (int i = 0; i < 10; ++i) {
    auto other = fit.offsets;
    other[rng.index(held.size())] += tutti::test::random_tangent(rng, 1e-3);
    RC_ASSERT(objective(error, held, other) > objective(error, held, fit.offsets));
  }
}

// Laid on node a, odometry misses b by what smoothing would have to bend: the residual of the chain that hangs on a.
RC_GTEST_PROP(OdometryError, MissedIsWhatHangsOffTheOtherEnd, (std::uint64_t seed)) {
  Rng rng(seed);
  const NoisyRun run = random_run(60, seed, 1e-5);
  const auto ends = some_nodes(60, 2, rng);
  const Eigen::MatrixXd hanging = smoothed(run, {ends[0]}, {run.server[ends[0]]});
  const Vector6d missed = run.error().missed(ends[0], ends[1]);
  RC_ASSERT((missed - hanging.row(static_cast<Eigen::Index>(ends[1])).transpose()).norm() <
            1e-2 * missed.norm() + 1e-9);
}

// By drawing: the spread of what is missed is what the covariance says.
TEST(OdometryErrorMissed, HasTheCovarianceItSays) {
  Matrix6d sum = Matrix6d::Zero();
  constexpr int kDraws = 2000;
  const NoisyRun reference = random_run(12, 7, 1e-4);
  const Matrix6d expected = reference.error().missed_covariance(2, 11);
  for (std::uint64_t draw = 0; draw < kDraws; ++draw) {
    NoisyRun run = reference;
    Rng rng(100 + draw);
    for (std::size_t k = 1; k < run.size(); ++k) {
      const Vector6d off = run.odometry[k].covariance.llt().matrixL() * tutti::test::random_tangent(rng);
      run.odometry[k].T_a_b = retract(run.server[k - 1].inverse() * run.server[k], off);
    }
    const Vector6d missed = run.error().missed(2, 11);
    sum += missed * missed.transpose() / kDraws;
  }
  // Whitened, it is the identity but for the sampling (0.03 an entry).
  const Eigen::LLT<Matrix6d> root(expected);
  const Matrix6d white = root.matrixL().solve(root.matrixL().solve(sum).transpose());
  EXPECT_LT((white - Matrix6d::Identity()).cwiseAbs().maxCoeff(), 0.15);
}

// A slide that odometry flagged (sigma times 100) must not drown what comes after it.
TEST(OdometryError, StaysExactBehindAStretchOfInflatedCovariance) {
  const std::size_t nodes = 1300;
  NoisyRun run{.server = test::corridor(nodes)};
  const test::OdometryNoise noise;
  run.odometry.push_back({});
  for (const Pose3& T : test::odometry_increments(run.server, noise, Rng(1)))
    run.odometry.push_back({T, test::covariance_of(noise)});
  for (std::size_t k = 600; k < 660; ++k) run.odometry[k].covariance *= 1e4;
  run.odometry[1200].T_a_b = run.odometry[1200].T_a_b * test::at(0.5, 0, 0);
  const OdometryError error = run.error();
  for (const std::size_t length : {2U, 10U, 60U, 100U, 250U}) {
    const std::size_t a = 1199, b = std::min(a + length, nodes - 1);
    EXPECT_NEAR(error.bridged(a, b), squared(error.residual(std::vector{a, b}, {}), a + 1, b - 1), 0.01) << length;
  }
  const std::vector<std::size_t> held{10, 400, 650, 1199, 1200, 1290};
  const auto fit = error.fit(held);
  EXPECT_NEAR(objective(error, held, fit.offsets), fit.squared_error, 1e-6 * objective(error, held, {}));
}

TEST(OdometryError, NothingIsOffWhereOdometryAgrees) {
  NoisyRun run = random_run(50, 1, 1e-3);
  for (std::size_t k = 1; k < run.size(); ++k) run.odometry[k].T_a_b = run.server[k - 1].inverse() * run.server[k];
  const OdometryError error = run.error();
  EXPECT_LT(error.bridged(0, 49), 1e-18);
  EXPECT_LT(error.hanging(20, 20, 49), 1e-18);
  EXPECT_LT(error.fit(std::vector<std::size_t>{5, 30}).squared_error, 1e-18);
}

}  // namespace
}  // namespace tutti::consistency::internal
