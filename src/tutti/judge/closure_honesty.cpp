// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/closure_honesty.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "tutti/base/chi_square.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::judge {
namespace {

constexpr std::size_t kEnoughPairs = 8;
constexpr double kPairsShare = 0.25;
/// Chance makes factors up to about this.
constexpr double kByChance = 2.0;
constexpr double kMostRaised = 400.0;
/// Halvings of the logarithm of the range: the factor is found to 0.2 %.
constexpr int kRaiseBisections = 12;

/// How many of the pairs miss, in the last N coordinates, by no more than a quarter may.
template <int N>
std::size_t count_within(const std::vector<ClosurePair>& pairs, const ClosureHonesty& by) {
  const double limit = chi_square_quantile(kPairsShare, N);
  const auto within = std::ranges::count_if(pairs, [&](ClosurePair pair) {
    for (LoopClosure* closure : {&pair.first, &pair.second})
      closure->measurement.covariance = scaled(closure->measurement.covariance, by);
    const OdometryLoop loop = loop_of(pair);
    const Eigen::Matrix<double, N, N> C = (loop.odometry + loop.closures).bottomRightCorner<N, N>();
    const Eigen::Matrix<double, N, 1> missed = loop.missed.tail<N>();
    return squared_distance(missed, C) <= limit;
  });
  return static_cast<std::size_t>(within);
}

/// The chance that no more than `count` of `trials` are within where each is with a chance of a quarter.
double chance_of_so_few(std::size_t count, std::size_t trials) {
  double sum = 0.0;
  double log_chance = static_cast<double>(trials) * std::log1p(-kPairsShare);  // of exactly k
  for (std::size_t k = 0; k <= count; ++k) {
    sum += std::exp(log_chance);
    log_chance +=
        std::log(static_cast<double>(trials - k) / static_cast<double>(k + 1) * kPairsShare / (1.0 - kPairsShare));
  }
  return sum;
}

/// The least factor above 1 for which `fits` holds; 1 if none does: then too many closures are wrong to judge by.
template <class Fits>
double least_raise(const Fits& fits) {
  if (!fits(kMostRaised)) return 1.0;
  double too_small = 1.0, enough = kMostRaised;
  for (int k = 0; k < kRaiseBisections; ++k) {
    const double middle = std::sqrt(too_small * enough);
    (fits(middle) ? enough : too_small) = middle;
  }
  return enough;
}

/// The factor that these pairs ask for; 1 where chance has made it. by(factor): all factors with this one. `tests`: how
/// often that is asked of a map. Among so many, chance makes less than one that counts (Desolneux, Moisan, Morel 2000),
/// so in a large fleet it takes more pairs to count.
template <int N, class By>
double factor_of(const std::vector<ClosurePair>& pairs, std::size_t tests, const By& by) {
  const auto are_enough = [&](std::size_t within) {
    return static_cast<double>(within) >= kPairsShare * static_cast<double>(pairs.size());
  };
  const std::size_t within = count_within<N>(pairs, by(1.0));
  if (are_enough(within) || chance_of_so_few(within, pairs.size()) * static_cast<double>(tests) > 1.0) return 1.0;
  return least_raise([&](double factor) { return are_enough(count_within<N>(pairs, by(factor))); });
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
  auto neighbours = neighbouring_closures(segments, closures);
  std::erase_if(neighbours, [](const auto& entry) { return entry.second.size() < kEnoughPairs; });
  const std::size_t tests = 2 * neighbours.size();
  for (const auto& [between, pairs] : neighbours) {
    ClosureHonesty honesty;
    honesty.rotation = factor_of<3>(pairs, tests, [](double f) { return ClosureHonesty{1.0, f}; });
    honesty.translation = factor_of<6>(pairs, tests, [&](double f) { return ClosureHonesty{f, honesty.rotation}; });
    if (std::max(honesty.rotation, honesty.translation) > kByChance) out[between] = honesty;
  }
  return out;
}

}  // namespace tutti::judge
