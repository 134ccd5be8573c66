// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/odometry_honesty.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tutti/base/chi_square.hpp"

namespace tutti::server {
namespace {

constexpr double kLeast = 0.04;
constexpr double kMost = 400.0;
constexpr std::size_t kEnough = 8;
constexpr double kMargin = 2.0;
constexpr double kRotationShare = 0.7;
/// Halvings of the logarithm of the range: the factor is found to 0.2 %.
constexpr int kBisections = 12;

/// The least factor on odometry's covariance, of so many of the last coordinates, with which `share` of the loops miss
/// by no more than they may; on that of the closures, too, if the whole loop is judged. Loops tell of odometry if it
/// knows their first three coordinates worse than closures do.
template <int N>
double least_factor(const std::vector<OdometryLoop>& loops, double share, bool with_closures) {
  std::vector<const OdometryLoop*> telling;
  for (const OdometryLoop& loop : loops)
    if (loop.odometry.template bottomRightCorner<N, N>().template topLeftCorner<3, 3>().trace() >
        loop.closures.template bottomRightCorner<N, N>().template topLeftCorner<3, 3>().trace())
      telling.push_back(&loop);
  if (telling.size() < kEnough) return 1.0;
  const double limit = chi_square_quantile(share, N);
  const auto explains = [&](double factor) {
    const auto within = std::ranges::count_if(telling, [&](const OdometryLoop* loop) {
      const Eigen::Matrix<double, N, N> C = (with_closures ? factor : 1.0) * loop->closures.bottomRightCorner<N, N>() +
                                            factor * loop->odometry.bottomRightCorner<N, N>();
      const Eigen::Matrix<double, N, 1> missed = loop->missed.tail<N>();
      return missed.dot(C.ldlt().solve(missed)) <= limit;
    });
    return static_cast<double>(within) >= share * static_cast<double>(telling.size());
  };
  if (explains(kLeast)) return kLeast;
  double too_small = kLeast, enough = kMost;
  for (int k = 0; k < kBisections; ++k) {
    const double middle = std::sqrt(too_small * enough);
    (explains(middle) ? enough : too_small) = middle;
  }
  return enough;
}

}  // namespace

std::map<ChainId, OdometryHonesty> odometry_honesty(std::span<const OdometryChain> chains,
                                                    std::span<const LoopClosure> closures) {
  std::map<ChainId, OdometryHonesty> out;
  for (const auto& [chain, loops] : odometry_loops(chains, closures)) {
    const double whole = least_factor<6>(loops, 0.5, false);
    out[chain] = {std::min(1.0, kMargin * least_factor<3>(loops, kRotationShare, false)),
                  whole > 1.0 ? whole : std::min(1.0, least_factor<6>(loops, 0.5, true))};
  }
  return out;
}

Matrix6d scale_rotation(const Matrix6d& covariance, double factor) {
  Vector6d scale = Vector6d::Ones();
  scale.tail<3>().setConstant(std::sqrt(factor));
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace tutti::server
