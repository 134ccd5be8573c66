// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/rotation_honesty.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tutti/server/odometry_loops.hpp"

namespace tutti::server {
namespace {

constexpr double kLeast = 0.04;
constexpr std::size_t kEnough = 8;
/// Loops share their odometry, so that a walk tells of it only to about this factor: honest odometry must stay honest.
constexpr double kMargin = 2.0;
/// Share of the loops, and the chi-square quantile (3 degrees of freedom) of that probability.
constexpr double kShare = 0.7;
constexpr double kChiSquare3 = 3.665;
/// Halvings of the logarithm of the range: the factor is found to 0.1 %.
constexpr int kBisections = 12;

/// A loop as far as it tells of rotation.
struct Turn {
  Eigen::Vector3d missed;
  Eigen::Matrix3d odometry;
  Eigen::Matrix3d closures;

  [[nodiscard]] bool tells_of_odometry() const { return odometry.trace() > closures.trace(); }
  [[nodiscard]] bool is_within(double factor) const {
    return missed.dot((closures + factor * odometry).ldlt().solve(missed)) <= kChiSquare3;
  }
};

std::vector<Turn> turns_of(const std::vector<OdometryLoop>& loops) {
  std::vector<Turn> out;
  for (const OdometryLoop& loop : loops) {
    const Turn turn{loop.missed.tail<3>(), loop.odometry.bottomRightCorner<3, 3>(),
                    loop.closures.bottomRightCorner<3, 3>()};
    if (turn.tells_of_odometry()) out.push_back(turn);
  }
  return out;
}

double factor_of(const std::vector<Turn>& turns) {
  const auto explains = [&](double factor) {
    const auto within = std::ranges::count_if(turns, [&](const Turn& turn) { return turn.is_within(factor); });
    return static_cast<double>(within) >= kShare * static_cast<double>(turns.size());
  };
  if (turns.size() < kEnough || !explains(1.0)) return 1.0;
  if (explains(kLeast)) return kLeast;
  double too_small = kLeast, enough = 1.0;
  for (int k = 0; k < kBisections; ++k) {
    const double middle = std::sqrt(too_small * enough);
    (explains(middle) ? enough : too_small) = middle;
  }
  return enough;
}

}  // namespace

std::map<ChainId, double> rotation_variance_factors(std::span<const estimation::OdometryChain> chains,
                                                    std::span<const LoopClosure> closures) {
  std::map<ChainId, double> out;
  for (const auto& [chain, loops] : odometry_loops(chains, closures))
    out[chain] = std::min(1.0, kMargin * factor_of(turns_of(loops)));
  return out;
}

Matrix6d scale_rotation(const Matrix6d& covariance, double factor) {
  Vector6d scale = Vector6d::Ones();
  scale.tail<3>().setConstant(std::sqrt(factor));
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace tutti::server
