// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/jump.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "tutti/estimation/internal/chain_run.hpp"

namespace tutti::estimation {
namespace {

/// What the guess leaves of a gap that doubt alone does not explain. Measured over all missions: slips of 20 degrees
/// at most 0.022, anything else at least 0.26.
constexpr double kExplained = 0.1;
constexpr std::size_t kSuspects = 6;
/// How the body moves is learnt from so many steps on either side,
constexpr std::size_t kNearby = 16;
/// each beside the nearest ones, this many with itself; fewer examples than twice as many teach nothing.
constexpr std::size_t kStencil = 5;
constexpr std::size_t kFewestExamples = 2 * kStencil;

double squared_distance(const Pose3& one, const Pose3& other, const Matrix6d& covariance) {
  const Vector6d apart = local(one, other);
  return apart.dot(covariance.llt().solve(apart));
}

/// What the motion around a step says of it: the mean of the nearest others, as uncertain as such a guess is nearby.
/// Nothing in short chains.
std::optional<RelativePose> expected_motion(std::span<const RelativePose> odometry, std::size_t step) {
  const std::size_t begin = step - std::min(step, kNearby), end = std::min(odometry.size(), step + kNearby + 1);
  if (end - begin < kStencil) return std::nullopt;
  Eigen::Matrix<double, 6, Eigen::Dynamic> motion(6, static_cast<Eigen::Index>(end - begin));
  for (std::size_t k = begin; k < end; ++k)
    motion.col(static_cast<Eigen::Index>(k - begin)) = local(Pose3{}, odometry[k].T_a_b);
  const std::size_t first = std::clamp(step - std::min(step, kStencil / 2), begin, end - kStencil);
  const auto nearest_to_step = static_cast<Eigen::Index>(step - first);
  const auto mean_of_others = [&](std::size_t k) {
    const auto stencil = motion.middleCols<kStencil>(static_cast<Eigen::Index>(k - begin));
    return Vector6d((stencil.rowwise().sum() - stencil.col(nearest_to_step)) / (kStencil - 1));
  };
  Matrix6d scatter = Matrix6d::Zero();
  std::size_t examples = 0;
  for (std::size_t k = begin; k + kStencil <= end; ++k) {
    if (step >= k && step < k + kStencil) continue;
    const Vector6d missed = motion.col(static_cast<Eigen::Index>(k - begin) + nearest_to_step) - mean_of_others(k);
    scatter += missed * missed.transpose();
    ++examples;
  }
  if (examples < kFewestExamples) return std::nullopt;
  return RelativePose{retract(Pose3{}, mean_of_others(first)),
                      odometry[step].covariance + scatter / static_cast<double>(examples)};
}

/// Squared distance of where the steps lead to, in the covariance of both.
double gap(std::span<const RelativePose> steps, const RelativePose& begin_end) {
  const internal::RunSum way = internal::sum_odometry(steps);
  const Matrix6d to_end = adjoint(way.T_a_b.inverse());
  return squared_distance(way.T_a_b, begin_end.T_a_b,
                          to_end * way.covariance * to_end.transpose() + begin_end.covariance);
}

/// The steps that differ most from the mean of their neighbours, in their own covariance; the most first.
std::vector<std::size_t> suspects(std::span<const RelativePose> odometry, std::size_t begin, std::size_t end) {
  std::vector<std::pair<double, std::size_t>> steps;
  for (std::size_t k = std::max<std::size_t>(begin, 1); k < std::min(end, odometry.size() - 1); ++k)
    steps.emplace_back(-squared_distance(interpolate(odometry[k - 1].T_a_b, odometry[k + 1].T_a_b, 0.5),
                                         odometry[k].T_a_b, odometry[k].covariance),
                       k);
  const std::size_t count = std::min(kSuspects, steps.size());
  std::partial_sort(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(count), steps.end());
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(steps[i].second);
  if (begin == 0) out.push_back(0);  // at the ends of the chain one cannot tell
  if (end == odometry.size()) out.push_back(end - 1);
  return out;
}

}  // namespace

std::optional<OdometryJump> find_jump(std::span<const RelativePose> odometry, std::size_t begin, std::size_t end,
                                      const RelativePose& begin_end) {
  if (end <= begin) return std::nullopt;
  std::vector<RelativePose> steps(odometry.begin() + static_cast<std::ptrdiff_t>(begin),
                                  odometry.begin() + static_cast<std::ptrdiff_t>(end));
  const double before = gap(steps, begin_end);
  if (!(before > kJumpGap)) return std::nullopt;
  std::optional<OdometryJump> best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t suspect : suspects(odometry, begin, end)) {
    const auto expected = expected_motion(odometry, suspect);
    if (!expected) continue;
    RelativePose& step = steps[suspect - begin];
    step.covariance = expected->covariance;
    const double doubted = gap(steps, begin_end);
    step = *expected;
    const double repaired = gap(steps, begin_end);
    step = odometry[suspect];
    if (!(doubted > kJumpGap && repaired <= kExplained * doubted && repaired < least)) continue;
    best = OdometryJump{suspect, *expected};
    least = repaired;
  }
  return best;
}

}  // namespace tutti::estimation
