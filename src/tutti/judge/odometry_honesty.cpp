// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/odometry_honesty.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "tutti/base/chi_square.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::judge {
namespace {

constexpr double kLeast = 0.04;
constexpr double kMost = 400.0;
constexpr std::size_t kEnough = 8;
/// A factor is lowered no further than to where loops that miss so little are still this likely.
constexpr double kLikely = 0.1;
constexpr double kRotationShare = 0.7;
/// Halvings of the logarithm of the range: the factor is found to 0.2 %.
constexpr int kBisections = 12;

using Loops = std::vector<const OdometryLoop*>;

/// The loops that measure odometry: it knows the first three of their last N coordinates worse than closures do. None
/// if there are too few.
template <int N>
Loops telling(const std::vector<OdometryLoop>& loops) {
  Loops out;
  for (const OdometryLoop& loop : loops)
    if (loop.odometry.template bottomRightCorner<N, N>().template topLeftCorner<3, 3>().trace() >
        loop.closures.template bottomRightCorner<N, N>().template topLeftCorner<3, 3>().trace())
      out.push_back(&loop);
  if (out.size() < kEnough) out.clear();
  return out;
}

/// How many of the loops are worth one that shares no odometry with any other: the robot's odometry that they go over,
/// in loops of their mean length.
double independent_loops(Loops loops) {
  std::ranges::sort(loops, {}, &OdometryLoop::first);
  double covered = 0.0, sum = 0.0;
  std::uint32_t known = 0;  // up to here
  for (const OdometryLoop* loop : loops) {
    covered += std::max(known, loop->last) - std::max(known, loop->first);
    sum += loop->last - loop->first;
    known = std::max(known, loop->last);
  }
  return sum > 0.0 ? static_cast<double>(loops.size()) * covered / sum : 1.0;
}

/// By how much a factor of N coordinates of these loops may be too small by chance.
template <int N>
double margin(const Loops& loops) {
  const double degrees = N * independent_loops(loops);
  return degrees / chi_square_quantile(kLikely, degrees);
}

/// The least factor on odometry's covariance, of so many of the last coordinates, with which `share` of the loops miss
/// by no more than they may; on that of the closures, too, if the whole loop is judged. 1 of no loops.
template <int N>
double least_factor(const Loops& loops, double share, bool with_closures) {
  if (loops.empty()) return 1.0;
  const double limit = chi_square_quantile(share, N);
  const auto explains = [&](double factor) {
    const auto within = std::ranges::count_if(loops, [&](const OdometryLoop* loop) {
      const Eigen::Matrix<double, N, N> C = (with_closures ? factor : 1.0) * loop->closures.bottomRightCorner<N, N>() +
                                            factor * loop->odometry.bottomRightCorner<N, N>();
      const Eigen::Matrix<double, N, 1> missed = loop->missed.tail<N>();
      return squared_distance(missed, C) <= limit;
    });
    return static_cast<double>(within) >= share * static_cast<double>(loops.size());
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

std::map<ChainId, OdometryHonesty> odometry_honesty(std::span<const OdometrySegment> segments,
                                                    std::span<const LoopClosure> closures) {
  std::map<ChainId, OdometryHonesty> out;
  for (const auto& [chain, loops] : odometry_loops(segments, closures)) {
    const Loops turning = telling<3>(loops), all = telling<6>(loops);
    const double whole = least_factor<6>(all, 0.5, false);
    out[chain] = {std::min(1.0, margin<3>(turning) * least_factor<3>(turning, kRotationShare, false)),
                  whole > 1.0 ? whole : std::min(1.0, margin<6>(all) * least_factor<6>(all, 0.5, true))};
  }
  return out;
}

Matrix6d scale_rotation(const Matrix6d& covariance, double factor) {
  Vector6d scale = Vector6d::Ones();
  scale.tail<3>().setConstant(std::sqrt(factor));
  return scale.asDiagonal() * covariance * scale.asDiagonal();
}

}  // namespace tutti::judge
