// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/wire/internal/quantise.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>

#include "support/wire/messages.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/wire/internal/columns.hpp"

namespace tutti::wire {
namespace quantise_test {

Rng any_rng() { return Rng(*rc::gen::arbitrary<std::uint32_t>()); }

/// Relative change of the variance in the direction where it changed most.
double worst_change(const Matrix6d& before, const Matrix6d& after) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<Matrix6d> solver(after, before, Eigen::EigenvaluesOnly);
  return (solver.eigenvalues().array() - 1.0).abs().maxCoeff();
}

RC_GTEST_PROP(QuantisePose, KeepsTheStatedErrorsAndChangesOnlyOnce, ()) {
  Rng rng = any_rng();
  const double extent_m = *rc::gen::element(0.01, 10.0, 1e5, 1e9);
  const Pose3 T = test::any_pose(rng, extent_m, *rc::gen::element(1e-7, 0.5, std::numbers::pi));
  const struct {
    PoseSteps steps;
    double max_m, max_rad;
  } cases[] = {{kKeyframePoseSteps, 1e-5, 1e-6}, {kProxyPoseSteps, 5e-4, 1e-4}};
  for (const auto& c : cases) {
    const PoseCode code = quantise(T, c.steps);
    const auto back = dequantise(code, c.steps);
    RC_ASSERT(back.has_value());
    const Vector6d error = local(T, *back);
    RC_ASSERT(error.head<3>().norm() <= c.max_m + 1e-6 * (extent_m >= 1e9));
    RC_ASSERT(error.tail<3>().norm() <= c.max_rad);
    RC_ASSERT(quantise(*back, c.steps) == code);
  }
}

TEST(QuantisePose, HalfTurnsStayUnique) {
  Rng rng(1);
  for (int i = 0; i < 2000; ++i) {
    Eigen::Vector3d axis(rng.normal(), rng.normal(), rng.normal());
    if (i % 4 == 0) axis = Eigen::Vector3d::Unit(i / 4 % 3);
    const double angle = std::numbers::pi + rng.normal(1e-7) * (i % 3);
    const Pose3 T{so3_exp(angle * axis.normalized()).normalized(), Eigen::Vector3d::Zero()};
    const PoseCode code = quantise(T, kKeyframePoseSteps);
    const auto back = dequantise(code, kKeyframePoseSteps);
    ASSERT_TRUE(back.has_value());
    EXPECT_LE(local(T, *back).tail<3>().norm(), 2e-6);  // twice the usual, within one step of a half turn
    EXPECT_EQ(quantise(*back, kKeyframePoseSteps), code);
  }
}

TEST(QuantisePose, RefusesWhatItWouldNotMake) {
  EXPECT_FALSE(dequantise({200'000'000'000'000, 0, 0, 0, 0, 0}, kKeyframePoseSteps).has_value());
  EXPECT_FALSE(dequantise({0, 0, 0, 6'000'000, 3'000'000, 0}, kKeyframePoseSteps).has_value());
}

RC_GTEST_PROP(QuantiseCovariance, KeepsTheStatedErrorInEveryDirectionAndChangesOnlyOnce, ()) {
  Rng rng = any_rng();
  const Matrix6d covariance = test::any_covariance(rng);
  // Coordinates that the others determine to 1e-3 are another test's.
  const Matrix6d G = covariance.llt().matrixL();
  RC_PRE((G.diagonal().array().square() > 4e-6 * covariance.diagonal().array()).all());
  for (const auto& [steps, bound] :
       {std::pair{kKeyframeCovarianceSteps, 0.01}, std::pair{kProxyCovarianceSteps, 0.25}}) {
    const CovarianceCode code = quantise(covariance, steps);
    const auto back = dequantise(code, steps);
    RC_ASSERT(back.has_value());
    RC_ASSERT(*back == back->transpose());
    RC_ASSERT(is_definite(*back));
    RC_ASSERT(worst_change(covariance, *back) < bound);
    RC_ASSERT(quantise(*back, steps) == code);
  }
}

TEST(QuantiseCovariance, ZeroAndPartlyZero) {
  EXPECT_EQ(dequantise(quantise(Matrix6d::Zero().eval(), kProxyCovarianceSteps), kProxyCovarianceSteps),
            Matrix6d::Zero().eval());
  Matrix6d planar = Matrix6d::Zero();
  planar(0, 0) = planar(1, 1) = 1e-2;
  planar(5, 5) = 1e-4;
  planar(1, 5) = planar(5, 1) = 8e-4;
  const auto back = dequantise(quantise(planar, kKeyframeCovarianceSteps), kKeyframeCovarianceSteps);
  ASSERT_TRUE(back.has_value());
  EXPECT_LT((*back - planar).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_NEAR((*back)(1, 5), 8e-4, 8e-6);
  EXPECT_EQ((*back)(2, 2), 0.0);
  EXPECT_EQ(back->row(3).norm(), 0.0);
}

TEST(QuantiseCovariance, SingularOnesStaySemidefiniteAndFinite) {
  // Rank one: every coordinate determines every other.
  const Vector6d direction = (Vector6d() << 1.0, 2.0, -0.5, 0.1, 0.02, 0.3).finished();
  const Matrix6d covariance = direction * direction.transpose();
  const auto back = dequantise(quantise(covariance, kKeyframeCovarianceSteps), kKeyframeCovarianceSteps);
  ASSERT_TRUE(back.has_value());
  EXPECT_TRUE(is_definite(*back));
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      EXPECT_NEAR((*back)(i, j), covariance(i, j), 0.01 * std::abs(direction(i) * direction(j)));
}

TEST(QuantiseCovariance, RefusesWhatItWouldNotMake) {
  CovarianceCode code{};
  code[0] = -1;
  EXPECT_FALSE(dequantise(code, kProxyCovarianceSteps).has_value());
  code[0] = std::int64_t{1} << 60;
  EXPECT_FALSE(dequantise(code, kProxyCovarianceSteps).has_value());
  code[0] = 0;
  code[6] = 5;  // correlation of coordinates without variance
  EXPECT_FALSE(dequantise(code, kProxyCovarianceSteps).has_value());
}

RC_GTEST_PROP(Columns, RoundTripEvenWhenDifferencesWrap, (const std::vector<std::array<std::int64_t, 3>>& rows)) {
  struct Field {  // what is used of a protobuf repeated field
    std::vector<std::int64_t> values;
    void Reserve(int) {}
    void Add(std::int64_t v) { values.push_back(v); }
    int size() const { return static_cast<int>(values.size()); }
    std::int64_t Get(int i) const { return values[static_cast<std::size_t>(i)]; }
  } field;
  write_columns(rows, field);
  RC_ASSERT(read_columns<3>(field, rows.size()) == rows);
  RC_ASSERT(!read_columns<3>(field, rows.size() + 1).has_value());
}

}  // namespace quantise_test
}  // namespace tutti::wire
