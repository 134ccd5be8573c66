// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/robust_loss.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace tutti::estimation {
namespace robust_loss_test {

constexpr LossKind kKinds[] = {LossKind::none, LossKind::huber, LossKind::cauchy};

TEST(RobustLoss, WeightIsTheDerivative) {
  for (const LossKind kind : kKinds)
    for (const double scale : {0.5, 1.0, 3.0})
      for (const double s : {1e-3, 0.1, 0.9, 2.0, 30.0, 1e4}) {
        const RobustLoss loss{kind, scale};
        const double h = 1e-5 * s;
        const double numeric = (loss.rho(s + h) - loss.rho(s - h)) / (2.0 * h);
        EXPECT_NEAR(loss.weight(s), numeric, 1e-6 * (1.0 + numeric)) << static_cast<int>(kind) << " " << s;
      }
}

TEST(RobustLoss, CurvatureIsTheSecondDerivativeWhereConvex) {
  for (const LossKind kind : {LossKind::none, LossKind::cauchy})
    for (const double scale : {0.5, 1.0, 3.0})
      for (const double share : {1e-3, 0.1, 0.25, 0.6, 2.0, 10.0}) {
        const RobustLoss loss{kind, scale};
        const double r = scale * std::sqrt(share);
        const double h = 1e-4 * r;
        const auto half = [&](double x) { return 0.5 * loss.rho(x * x); };
        const double numeric = (half(r + h) - 2.0 * half(r) + half(r - h)) / (h * h) / loss.weight(r * r);
        EXPECT_NEAR(loss.curvature(r * r), numeric > 0.1 ? numeric : 1.0, 1e-5) << static_cast<int>(kind) << " " << r;
      }
}

TEST(RobustLoss, LeavesInliersAloneAndGrowsSlower) {
  for (const LossKind kind : kKinds) {
    const RobustLoss loss{kind, 2.0};
    EXPECT_EQ(loss.rho(0.0), 0.0);
    EXPECT_DOUBLE_EQ(loss.weight(0.0), 1.0);
    for (double s = 0.0; s < 100.0; s += 0.5) {
      EXPECT_LE(loss.rho(s), s);
      EXPECT_LE(loss.weight(s + 0.5), loss.weight(s));
      EXPECT_GT(loss.weight(s), 0.0);
    }
  }
}

TEST(RobustLoss, KnowsItsNames) {
  EXPECT_EQ(loss_kind("huber"), LossKind::huber);
  EXPECT_THROW(loss_kind("tukey"), std::logic_error);
}

}  // namespace robust_loss_test
}  // namespace tutti::estimation
