// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/jump.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
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

double squared_distance(const Vector6d& apart, const Matrix6d& covariance) {
  return apart.dot(covariance.llt().solve(apart));
}

/// How the body moved in some steps of odometry and around them, per unit of time.
class Rates {
 public:
  Rates(std::span<const RelativePose> odometry, std::span<const double> duration_s, std::size_t begin, std::size_t end)
      : odometry_(odometry),
        duration_s_(duration_s),
        begin_(begin - std::min(begin, kNearby)),
        end_(std::min(odometry.size(), end + kNearby)),
        rate_(6, static_cast<Eigen::Index>(end_ - begin_)) {
    for (std::size_t k = begin_; k < end_; ++k) rate_.col(column(k)) = local(Pose3{}, odometry[k].T_a_b) / duration(k);
  }

  /// What the motion around a step says of it: the mean of the nearest others, as uncertain as such a guess is nearby.
  /// Nothing in short chains.
  [[nodiscard]] std::optional<RelativePose> expected_motion(std::size_t step) const {
    const std::size_t begin = std::max(begin_, step - std::min(step, kNearby)),
                      end = std::min(end_, step + kNearby + 1);
    if (end - begin < kStencil) return std::nullopt;
    const std::size_t first = std::clamp(step - std::min(step, kStencil / 2), begin, end - kStencil);
    const auto centre = static_cast<Eigen::Index>(step - first);
    const auto mean_of_others = [&](std::size_t stencil_begin) {
      const auto stencil = rate_.middleCols<kStencil>(column(stencil_begin));
      return Vector6d((stencil.rowwise().sum() - stencil.col(centre)) / (kStencil - 1));
    };
    Matrix6d scatter = Matrix6d::Zero();
    std::size_t examples = 0;
    for (std::size_t k = begin; k + kStencil <= end; ++k) {
      if (step >= k && step < k + kStencil) continue;
      const Vector6d missed = rate_.col(column(k) + centre) - mean_of_others(k);
      scatter += missed * missed.transpose();
      ++examples;
    }
    if (examples < kFewestExamples) return std::nullopt;
    const double share = duration(step) * duration(step) / static_cast<double>(examples);
    return RelativePose{retract(Pose3{}, duration(step) * mean_of_others(first)),
                        odometry_[step].covariance + share * scatter};
  }

  /// Squared distance of a step, neither the first nor the last, from the mean of its neighbours, in its covariance.
  [[nodiscard]] double strangeness(std::size_t step) const {
    const auto k = column(step);
    return squared_distance(duration(step) * (rate_.col(k) - 0.5 * (rate_.col(k - 1) + rate_.col(k + 1))),
                            odometry_[step].covariance);
  }

 private:
  [[nodiscard]] Eigen::Index column(std::size_t step) const { return static_cast<Eigen::Index>(step - begin_); }
  [[nodiscard]] double duration(std::size_t step) const { return duration_s_.empty() ? 1.0 : duration_s_[step]; }

  std::span<const RelativePose> odometry_;
  std::span<const double> duration_s_;
  std::size_t begin_;
  std::size_t end_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> rate_;
};

/// Squared distance of where the steps lead to, in the covariance of both.
double gap(std::span<const RelativePose> steps, const RelativePose& begin_end) {
  const internal::RunSum way = internal::sum_odometry(steps);
  const Matrix6d to_end = adjoint(way.T_a_b.inverse());
  return squared_distance(local(way.T_a_b, begin_end.T_a_b),
                          to_end * way.covariance * to_end.transpose() + begin_end.covariance);
}

/// The strangest steps of [begin, end) and, as nobody can tell, the ends of the chain.
std::vector<std::size_t> suspects(const Rates& rates, std::size_t begin, std::size_t end, std::size_t steps) {
  std::vector<std::pair<double, std::size_t>> strange;
  for (std::size_t k = std::max<std::size_t>(begin, 1); k < std::min(end, steps - 1); ++k)
    strange.emplace_back(-rates.strangeness(k), k);
  const std::size_t count = std::min(kSuspects, strange.size());
  std::partial_sort(strange.begin(), strange.begin() + static_cast<std::ptrdiff_t>(count), strange.end());
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < count; ++i) out.push_back(strange[i].second);
  if (begin == 0) out.push_back(0);
  if (end == steps) out.push_back(end - 1);
  return out;
}

}  // namespace

std::optional<OdometryJump> find_jump(std::span<const RelativePose> odometry, std::size_t begin, std::size_t end,
                                      const RelativePose& begin_end, std::span<const double> duration_s) {
  TUTTI_CHECK(begin <= end && end <= odometry.size(), "steps {} to {} of {}", begin, end, odometry.size());
  TUTTI_CHECK(duration_s.empty() || duration_s.size() == odometry.size(), "{} durations of {} steps", duration_s.size(),
              odometry.size());
  if (begin == end) return std::nullopt;
  std::vector<RelativePose> steps(odometry.begin() + static_cast<std::ptrdiff_t>(begin),
                                  odometry.begin() + static_cast<std::ptrdiff_t>(end));
  if (!(gap(steps, begin_end) > kJumpGap)) return std::nullopt;
  const Rates rates(odometry, duration_s, begin, end);
  std::optional<OdometryJump> best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t suspect : suspects(rates, begin, end, odometry.size())) {
    const auto expected = rates.expected_motion(suspect);
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
