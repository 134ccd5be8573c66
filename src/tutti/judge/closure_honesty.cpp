// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/closure_honesty.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tutti/base/chi_square.hpp"

namespace tutti::judge {
namespace {

constexpr std::size_t kEnoughPairs = 8;
constexpr double kPairsShare = 0.25;
/// Chance makes factors up to about this.
constexpr double kByChance = 2.0;
constexpr double kMostRaised = 400.0;
/// Halvings of the logarithm of the range: the factor is found to 0.2 %.
constexpr int kRaiseBisections = 12;

/// True if a quarter of the pairs miss, in the last N coordinates, by no more than a quarter may.
template <int N>
bool a_quarter_fits(const std::vector<ClosurePair>& pairs, const ClosureHonesty& by) {
  const double limit = chi_square_quantile(kPairsShare, N);
  const auto within = std::ranges::count_if(pairs, [&](ClosurePair pair) {
    for (LoopClosure* closure : {&pair.first, &pair.second})
      closure->measurement.covariance = scaled(closure->measurement.covariance, by);
    const OdometryLoop loop = loop_of(pair);
    const Eigen::Matrix<double, N, N> C = (loop.odometry + loop.closures).bottomRightCorner<N, N>();
    const Eigen::Matrix<double, N, 1> missed = loop.missed.tail<N>();
    return missed.dot(C.ldlt().solve(missed)) <= limit;
  });
  return static_cast<double>(within) >= kPairsShare * static_cast<double>(pairs.size());
}

/// The least factor for which `fits` holds, at least 1; also 1 if none does: then too many closures are wrong to judge
/// by.
template <class Fits>
double least_raise(const Fits& fits) {
  if (fits(1.0) || !fits(kMostRaised)) return 1.0;
  double too_small = 1.0, enough = kMostRaised;
  for (int k = 0; k < kRaiseBisections; ++k) {
    const double middle = std::sqrt(too_small * enough);
    (fits(middle) ? enough : too_small) = middle;
  }
  return enough;
}

}  // namespace

Matrix6d scaled(const Matrix6d& covariance, const ClosureHonesty& by) {
  Vector6d scale;
  scale << Eigen::Vector3d::Constant(std::sqrt(by.translation)), Eigen::Vector3d::Constant(std::sqrt(by.rotation));
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

std::map<std::pair<ChainId, ChainId>, ClosureHonesty> closure_honesty(std::span<const OdometrySegment> segments,
                                                                      std::span<const LoopClosure> closures) {
  std::map<std::pair<ChainId, ChainId>, ClosureHonesty> out;
  for (const auto& [between, pairs] : neighbouring_closures(segments, closures)) {
    if (pairs.size() < kEnoughPairs) continue;
    ClosureHonesty honesty;
    honesty.rotation = least_raise([&](double f) { return a_quarter_fits<3>(pairs, {1.0, f}); });
    honesty.translation = least_raise([&](double f) { return a_quarter_fits<6>(pairs, {f, honesty.rotation}); });
    if (std::max(honesty.rotation, honesty.translation) > kByChance) out[between] = honesty;
  }
  return out;
}

}  // namespace tutti::judge
