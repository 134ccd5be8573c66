// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/closure_honesty.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "tutti/base/chi_square.hpp"

namespace tutti::judge {
namespace {

constexpr std::size_t kEnoughPairs = 8;
constexpr double kPairsShare = 0.25;
/// Chance makes factors up to about this.
constexpr double kByChance = 2.0;
constexpr double kMostRaised = 400.0;
/// Factors are tried in steps of a quarter of a power of two, with these shares of pairs that hold a wrong closure.
const double kStep = std::exp2(0.25);
constexpr double kWrongShares[] = {0.01, 0.1, 0.2, 0.35, 0.5, 0.65};
/// A wrong closure misses by anything from one standard deviation to so many: each power of ten is as likely.
constexpr double kMostMissed = 1e4;
/// A factor counts that explains the pairs this much better (logarithm of the likelihood) than what is stated does.
constexpr double kMuchBetter = 4.0;

template <int N>
using Covariance = Eigen::Matrix<double, N, N>;
template <int N>
using Missed = Eigen::Matrix<double, N, 1>;

/// What a pair misses in the last N coordinates, and its covariance with the factors `by`.
template <int N>
std::pair<Missed<N>, Covariance<N>> missed_by(ClosurePair pair, const ClosureHonesty& by) {
  for (LoopClosure* closure : {&pair.first, &pair.second})
    closure->measurement.covariance = scaled(closure->measurement.covariance, by);
  const OdometryLoop loop = loop_of(pair);
  return {loop.missed.tail<N>(), (loop.odometry + loop.closures).bottomRightCorner<N, N>()};
}

/// How many of the pairs miss, in the last N coordinates, by no more than a quarter may.
template <int N>
std::size_t count_within(const std::vector<ClosurePair>& pairs, const ClosureHonesty& by) {
  const double limit = chi_square_quantile(kPairsShare, N);
  const auto within = std::ranges::count_if(pairs, [&](const ClosurePair& pair) {
    const auto [missed, C] = missed_by<N>(pair, by);
    return missed.dot(C.ldlt().solve(missed)) <= limit;
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

/// The logarithm of a normal density, and of that of a pair with a wrong closure, both of what one pair misses and up
/// to (2 pi)^(-N/2).
struct Densities {
  double right = 0.0, wrong = 0.0;
};

template <int N>
Densities densities(const ClosurePair& pair, const ClosureHonesty& by) {
  const auto logarithms = [](const std::pair<Missed<N>, Covariance<N>>& of) {
    const Eigen::LLT<Covariance<N>> llt(of.second);
    return std::pair(of.first.dot(llt.solve(of.first)), llt.matrixLLT().diagonal().array().log().sum());
  };
  const auto [squared, root] = logarithms(missed_by<N>(pair, by));
  const auto [stated, stated_root] = logarithms(missed_by<N>(pair, {}));
  // In units of what is stated, its length has the density 1 / (r ln most), on a sphere of this surface.
  const double surface = 2.0 * std::pow(M_PI, 0.5 * N) / std::tgamma(0.5 * N);
  const double normal = 0.5 * N * std::log(2.0 * M_PI);
  return {-0.5 * squared - root,
          normal - stated_root - std::log(surface * std::log(kMostMissed)) - 0.5 * N * std::log(std::max(stated, 1.0))};
}

/// The logarithm of the likelihood of these pairs with the factors `by`, at the share of wrong ones that explains them
/// best. A closure is in two pairs, so two pairs count as one.
template <int N>
double log_likelihood(const std::vector<ClosurePair>& pairs, const ClosureHonesty& by) {
  std::vector<Densities> of;
  for (const ClosurePair& pair : pairs) of.push_back(densities<N>(pair, by));
  double best = -std::numeric_limits<double>::infinity();
  for (const double share : kWrongShares) {
    double sum = 0.0;
    for (const auto& [right, wrong] : of) {
      const double a = std::log1p(-share) + right, b = std::log(share) + wrong;
      sum += std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
    }
    best = std::max(best, sum);
  }
  return 0.5 * best;
}

/// The factor that these pairs ask for; 1 where chance has made it, or wrong closures among honest ones. by(factor):
/// all factors with this one. `tests`: how often that is asked of a map. Among so many, chance makes less than one that
/// counts (Desolneux, Moisan, Morel 2000), so in a large fleet it takes more pairs to count.
template <int N, class By>
double factor_of(const std::vector<ClosurePair>& pairs, std::size_t tests, const By& by) {
  const std::size_t within = count_within<N>(pairs, by(1.0));
  if (static_cast<double>(within) >= kPairsShare * static_cast<double>(pairs.size()) ||
      chance_of_so_few(within, pairs.size()) * static_cast<double>(tests) > 1.0)
    return 1.0;
  double best = 1.0, most = log_likelihood<N>(pairs, by(1.0)) + kMuchBetter + std::log(static_cast<double>(tests));
  for (double factor = kStep; factor < kMostRaised; factor *= kStep)
    if (const double likelihood = log_likelihood<N>(pairs, by(factor)); likelihood > most) {
      most = likelihood;
      best = factor;
    }
  return best;
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
