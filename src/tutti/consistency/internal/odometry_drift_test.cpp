// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/internal/odometry_drift.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "support/consistency/runs.hpp"
#include "tutti/estimation/onboard_smoother.hpp"

namespace tutti::consistency::internal {
namespace odometry_drift_test {

constexpr std::size_t kNodes = 50;

/// A server's poses and odometry that errs by `size` times its covariances, which are correlated and differ.
struct DriftedRun {
  std::vector<Pose3> server;
  std::vector<RelativePose> odometry;

  explicit DriftedRun(double size, std::uint64_t seed = 1) {
    Rng rng(seed);
    server = test::moved(test::random_pose(rng, 40.0), test::corridor(kNodes));
    odometry.push_back({});
    for (std::size_t k = 1; k < kNodes; ++k) {
      Matrix6d root;
      for (double& value : root.reshaped()) value = 0.3 * rng.normal();
      root.diagonal().array() += 1.0;
      Vector6d sigma;
      sigma << Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.005);
      root = size * std::exp(rng.normal(0.5)) * sigma.asDiagonal() * root;
      Vector6d error;
      for (double& value : error) value = rng.normal();
      const Matrix6d covariance = root * root.transpose();
      odometry.push_back(
          {retract(server[k - 1].inverse() * server[k], root * error), 0.5 * (covariance + covariance.transpose())});
    }
  }
  /// [position; rotation] in the server's axes.
  [[nodiscard]] Vector6d off(std::size_t node, const Pose3& pose) const {
    Vector6d out;
    out << pose.translation - server[node].translation, so3_log(pose.rotation * server[node].rotation.conjugate());
    return out;
  }
};

TEST(OdometryDrift, FixedNodesAreWhereTheServerHasThem) {
  const DriftedRun run(1.0);
  const OdometryDrift drift(run.server, run.odometry);
  const std::vector<std::size_t> all{0, 1, 7, 20, 33, 49};
  const Eigen::MatrixXd off = drift.with_fixed(all);
  ASSERT_EQ(off.rows(), static_cast<Eigen::Index>(kNodes));
  for (const std::size_t node : all) EXPECT_LT(off.row(static_cast<Eigen::Index>(node)).norm(), 1e-10) << node;
  EXPECT_GT(off.row(27).norm(), 1e-3);
  std::vector<std::size_t> each(kNodes);
  for (std::size_t k = 0; k < kNodes; ++k) each[k] = k;
  EXPECT_LT(drift.with_fixed(each).norm(), 1e-9);
  EXPECT_THROW((void)drift.with_fixed({}), std::logic_error);
  const std::vector<std::size_t> beyond{kNodes};
  EXPECT_THROW((void)drift.with_fixed(beyond), std::logic_error);
}

// Errors ten times smaller: what is neglected becomes a hundred times smaller.
TEST(OdometryDrift, MissesTheNodeByThePoseDifferenceToFirstOrder) {
  const std::pair<std::size_t, std::size_t> pairs[] = {{0, 1}, {0, 49}, {12, 13}, {10, 31}};
  for (const auto& [a, b] : pairs) {
    double neglected[2];
    for (const bool small : {false, true}) {
      const DriftedRun run(small ? 1e-3 : 1e-2);
      Pose3 T = run.server[a];
      for (std::size_t k = a + 1; k <= b; ++k) T = T * run.odometry[k].T_a_b;
      const Vector6d truth = run.off(b, T), predicted = OdometryDrift(run.server, run.odometry).missed(a, b);
      neglected[small ? 1 : 0] = (predicted - truth).norm();
      EXPECT_LT((predicted - truth).norm(), (small ? 1e-3 : 1e-2) * truth.norm()) << a << " " << b;
    }
    EXPECT_LT(neglected[1], 0.02 * neglected[0]) << a << " " << b;
  }
}

TEST(OdometryDrift, BeyondTheLastFixedNodeItIsWhatOdometryMisses) {
  const DriftedRun run(1.0);
  const OdometryDrift drift(run.server, run.odometry);
  const std::vector<std::size_t> fixed{9, 30};
  const Eigen::MatrixXd off = drift.with_fixed(fixed);
  for (const std::size_t node : {31U, 49U})
    EXPECT_LT((off.row(node).transpose() - drift.missed(30, node)).norm(), 1e-12);
  for (const std::size_t node : {0U, 8U}) EXPECT_LT((off.row(node).transpose() - drift.missed(9, node)).norm(), 1e-12);
}

// The error left when links fix nodes on the server's map is the one that the onboard smoother leaves.
TEST(OdometryDrift, IsTheFirstStepOfTheOnboardSmoother) {
  constexpr double kSize = 1e-3;
  const std::vector<std::size_t> fixed{3, 10, 11, 25, 40};
  for (std::uint64_t seed = 1; seed < 5; ++seed) {
    const DriftedRun run(kSize, seed);
    const Eigen::MatrixXd predicted = OdometryDrift(run.server, run.odometry).with_fixed(fixed);
    estimation::OnboardSmoother smoother;
    for (std::size_t k = 1; k < kNodes; ++k) smoother.append(run.odometry[k]);
    std::vector<estimation::ChainConstraint> links;
    for (std::size_t j = 1; j < fixed.size(); ++j)
      links.push_back({fixed[j - 1],
                       fixed[j],
                       {run.server[fixed[j - 1]].inverse() * run.server[fixed[j]], 1e-14 * Matrix6d::Identity()}});
    smoother.set_constraints(links);
    smoother.solve();
    const Pose3 T = run.server[fixed.front()] * smoother.pose(fixed.front()).inverse();
    for (std::size_t k = 0; k < kNodes; ++k) {
      const Vector6d row = predicted.row(static_cast<Eigen::Index>(k));
      EXPECT_LT((run.off(k, T * smoother.pose(k)) - row).norm(), 0.01 * predicted.rowwise().norm().maxCoeff()) << k;
    }
  }
}

}  // namespace odometry_drift_test
}  // namespace tutti::consistency::internal
