// SPDX-License-Identifier: BSD-3-Clause
// Who gives way, a constraint or the odometry. Sigmas are those of what odometry and constraint together leave open:
// P + R, P the covariance of the odometry between the constraint's ends and R the constraint's.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "tutti/estimation/testing/chain_mission.hpp"

namespace tutti::estimation {
namespace {

using namespace testing;

Rng any_rng() { return Rng(*rc::gen::arbitrary<std::uint32_t>()); }

/// What odometry says of node `to` seen from node `from`.
RelativePose odometry_between(const Mission& m, std::size_t from, std::size_t to) {
  RelativePose sum{.covariance = Matrix6d::Zero()};
  for (std::size_t k = from; k < to; ++k) sum = compound(sum, m.odometry[k]);
  return sum;
}

/// A constraint whose sigmas are `tightness` times the odometry's, and which contradicts it by `sigmas`.
ChainConstraint contradicting(Rng& rng, const Mission& m, std::size_t from, std::size_t to, double tightness,
                              double sigmas, bool doubtful) {
  const RelativePose odometry = odometry_between(m, from, to);
  const Matrix6d R = tightness * tightness * odometry.covariance;
  const Matrix6d both = odometry.covariance + R;
  const Vector6d off = both.llt().matrixL() * random_tangent(rng, 1.0, 1.0).normalized();
  return {from, to, {retract(odometry.T_a_b, sigmas * off), R}, doubtful};
}

/// How many of the odometry's sigmas the estimate between two nodes is away from it.
double sigmas_from_odometry(const Mission& m, const OnboardSmoother& smoother, std::size_t from, std::size_t to) {
  const RelativePose odometry = odometry_between(m, from, to);
  const Vector6d r = local(odometry.T_a_b, smoother.pose(from).inverse() * smoother.pose(to));
  return std::sqrt(r.dot(odometry.covariance.llt().solve(r)));
}

OnboardSmoother solved(const Mission& m, const OnboardSmootherConfig& config = {}) {
  auto smoother = smoother_of(m, config);
  EXPECT_TRUE(is_usable(smoother.solve().termination));
  return smoother;
}

RC_GTEST_PROP(OnboardSmootherDoubt, TrustedHoldsAgainstOdometry, ()) {
  Rng rng = any_rng();
  auto m = mission(rng, 200, 3);
  m.constraints.push_back(contradicting(rng, m, 30, 150, std::pow(10.0, rng.uniform(-2.0, 0.5)), 30.0, false));
  const auto smoother = solved(m);
  RC_ASSERT(smoother.constraint_weights() == std::vector<double>(m.constraints.size(), 1.0));
  RC_ASSERT(largest_position_difference(smoother.poses(), full_optimum(m, smoother.poses())) < 5e-3);
}

RC_GTEST_PROP(OnboardSmootherDoubt, DoubtfulAloneIsLetGo, ()) {
  Rng rng = any_rng();
  auto m = mission(rng, 200, 0);
  const double tightness = std::pow(10.0, rng.uniform(-3.0, 0.5));
  m.constraints.push_back(contradicting(rng, m, 30, 150, tightness, 20.0, true));
  const auto smoother = solved(m);
  RC_ASSERT(smoother.constraint_weights().back() < 0.05);
  RC_ASSERT(sigmas_from_odometry(m, smoother, 30, 150) < 1.0);
}

RC_GTEST_PROP(OnboardSmootherDoubt, DoubtfulThatAgreesKeepsItsWeight, ()) {
  Rng rng = any_rng();
  auto m = mission(rng, 200, 0);
  const double tightness = std::pow(10.0, rng.uniform(-3.0, 0.5));
  m.constraints.push_back(contradicting(rng, m, 30, 150, tightness, 2.0, true));
  const auto smoother = solved(m);
  RC_ASSERT(smoother.constraint_weights().back() > (tightness < 0.3 ? 0.95 : 0.65));
}

/// Trusted constraints correct odometry that slipped; of the doubtful ones some are right and some are not.
RC_GTEST_PROP(OnboardSmootherDoubt, MixturesAreTakenApart, ()) {
  Rng rng = any_rng();
  auto m = mission(rng, 400, 0, 8e-3, 3e-3);  // much looser than the constraints
  const std::size_t slip = 100 + rng.index(200);
  m.odometry[slip].T_a_b =
      retract(m.odometry[slip].T_a_b, 10.0 * sample(rng, odometry_between(m, slip - 40, slip + 40).covariance));
  const auto right = [&](std::size_t from, std::size_t to, bool doubtful) {
    const Matrix6d covariance = random_covariance(rng, 2e-3, 1e-3);
    const Pose3 exact = m.truth[from].inverse() * m.truth[to];
    m.constraints.push_back({from, to, {retract(exact, sample(rng, covariance)), covariance}, doubtful});
  };
  right(slip - 40, slip + 41, false);
  right(20, 380, false);  // the doubtful ones span the slip: within, who is to say where it slipped?
  for (std::size_t k = 1 + rng.index(5); k > 0; --k)
    right(rng.index(slip - 40), slip + 41 + rng.index(359 - slip), true);
  auto clean = m;
  const std::size_t first_wrong = m.constraints.size();
  for (std::size_t k = 1 + rng.index(4); k > 0; --k) {
    const std::size_t from = rng.index(slip - 40);
    m.constraints.push_back(contradicting(rng, m, from, slip + 41 + rng.index(40), 0.02, 40.0, true));
    // Contradicts what is true, too, and not only the odometry that slipped.
    auto& T = m.constraints.back().measurement.T_a_b;
    T = retract(T, random_tangent(rng, 0.5, 0.2));
  }
  const auto smoother = solved(m);
  for (std::size_t c = 0; c < first_wrong; ++c) RC_ASSERT(smoother.constraint_weights()[c] > 0.2);
  for (std::size_t c = first_wrong; c < m.constraints.size(); ++c) RC_ASSERT(smoother.constraint_weights()[c] < 0.01);
  RC_ASSERT(largest_position_difference(smoother.poses(), solved(clean).poses()) < 0.1);
}

/// Several doubtful constraints that agree with each other convict the odometry; one of them convicts itself.
TEST(OnboardSmootherDoubt, AgreementConvictsTheOdometry) {
  Rng rng(3);
  auto m = mission(rng, 300, 0);
  const auto slipped = contradicting(rng, m, 100, 200, 0.1, 12.0, true);
  for (std::size_t k = 0; k < 8; ++k) {
    ChainConstraint c = slipped;
    c.from -= 2 * k;
    c.to += 3 * k;
    c.measurement.T_a_b = odometry_between(m, c.from, slipped.from).T_a_b * slipped.measurement.T_a_b *
                          odometry_between(m, slipped.to, c.to).T_a_b;
    m.constraints.push_back(c);
  }
  const auto together = solved(m);
  for (const double weight : together.constraint_weights()) EXPECT_GT(weight, 0.3);
  EXPECT_GT(sigmas_from_odometry(m, together, 100, 200), 10.0);
  m.constraints.resize(1);
  const auto alone = solved(m);
  EXPECT_LT(alone.constraint_weights()[0], 0.1);
  EXPECT_LT(sigmas_from_odometry(m, alone, 100, 200), 1.0);
}

TEST(OnboardSmootherDoubt, WithoutALossEveryConstraintHolds) {
  Rng rng(4);
  auto m = mission(rng, 200, 2);
  m.constraints.push_back(contradicting(rng, m, 30, 150, 0.1, 20.0, true));
  auto smoother = smoother_of(m, {.loss = "none"});
  EXPECT_FALSE(smoother.solve().loss_applied);
  EXPECT_EQ(smoother.constraint_weights(), std::vector<double>(m.constraints.size(), 1.0));
  EXPECT_GT(sigmas_from_odometry(m, smoother, 30, 150), 15.0);
}

}  // namespace
}  // namespace tutti::estimation
