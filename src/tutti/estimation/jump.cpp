// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/jump.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <limits>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti::estimation {
namespace {

/// What the guess may leave of a gap that doubt alone does not explain.
constexpr double kExplained = 0.1;
/// How many times better the guess explains the gap, times how far the step is from it: both errors have heavy tails,
/// so evidence goes with the logarithms. Measured (docs/decisions/who-is-wrong.md): slips of 5 degrees and more 38,000
/// and more, steps that did not jump 5,600 at most.
constexpr double kLeastEvidence = 2e4;
/// The guess of a step that explains so much is as far from the step, (1 - sqrt(kExplained))^2 of the gap, or further.
constexpr double kLeastStrange = 0.46 * kJumpGap;
/// A step is guessed from the nearest others, this many with itself,
constexpr std::size_t kStencil = 5;
/// and how well such guesses do is learnt from so many steps on either side; fewer than this in all teach nothing.
constexpr std::size_t kNearby = 16;
constexpr std::size_t kFewestExamples = 10;

/// What the motion around a step says of it, and how far the step is from that (squared distance, in the covariance).
struct Guess {
  RelativePose motion;
  double strangeness = 0.0;
};

/// How the body moved in the steps [begin, end) of odometry, per unit of time, and what the motion around each step
/// says of it.
class Rates {
 public:
  Rates(std::span<const RelativePose> odometry, std::span<const double> duration_s, std::size_t begin, std::size_t end)
      : odometry_(odometry),
        duration_s_(duration_s),
        begin_(begin - std::min(begin, kNearby)),
        end_(std::min(odometry.size(), end + kNearby)) {
    if (end_ - begin_ < kStencil) return;
    rate_.resize(6, column(end_));
    for (std::size_t k = begin_; k < end_; ++k) rate_.col(column(k)) = local(Pose3{}, odometry[k].T_a_b) / duration(k);
    missed_.resize(6, column(end_));
    for (std::size_t k = begin_; k < end_; ++k) missed_.col(column(k)) = rate_.col(column(k)) - mean_of_nearest(k);
  }

  /// The mean of the nearest others, as uncertain as such a guess is nearby. Nothing in short chains.
  [[nodiscard]] std::optional<Guess> guess(std::size_t step) const {
    const auto covariance = covariance_of_guess(step);
    if (!covariance) return std::nullopt;
    const Vector6d missed = duration(step) * missed_.col(column(step));
    return Guess{{retract(Pose3{}, duration(step) * mean_of_nearest(step)), *covariance},
                 missed.dot(covariance->llt().solve(missed))};
  }

 private:
  using Columns = Eigen::Matrix<double, 6, Eigen::Dynamic>;

  [[nodiscard]] Eigen::Index column(std::size_t step) const { return static_cast<Eigen::Index>(step - begin_); }
  [[nodiscard]] double duration(std::size_t step) const { return duration_s_.empty() ? 1.0 : duration_s_[step]; }

  [[nodiscard]] Vector6d mean_of_nearest(std::size_t step) const {
    const std::size_t first = std::clamp(step - std::min(step, kStencil / 2), begin_, end_ - kStencil);
    const auto stencil = rate_.middleCols<kStencil>(column(first));
    return (stencil.rowwise().sum() - rate_.col(column(step))) / (kStencil - 1);
  }

  /// From the steps nearby whose own guess is from either side and does not contain this one.
  [[nodiscard]] std::optional<Matrix6d> covariance_of_guess(std::size_t step) const {
    if (missed_.cols() == 0) return std::nullopt;
    constexpr Eigen::Index reach = kStencil / 2, nearby = kNearby;
    const Eigen::Index k = column(step), most = missed_.cols() - reach;
    const Eigen::Index before = std::max(reach, k - nearby), after = std::min(most, k + nearby + 1);
    const Eigen::Index left = std::max<Eigen::Index>(0, k - reach - before);
    const Eigen::Index right = std::max<Eigen::Index>(0, after - (k + reach + 1));
    if (left + right < static_cast<Eigen::Index>(kFewestExamples)) return std::nullopt;
    Matrix6d scatter = Matrix6d::Zero();
    for (Eigen::Index i = 0; i < left; ++i) scatter += missed_.col(before + i) * missed_.col(before + i).transpose();
    for (Eigen::Index i = 1; i <= right; ++i) scatter += missed_.col(after - i) * missed_.col(after - i).transpose();
    const double share = duration(step) * duration(step) / static_cast<double>(left + right);
    return odometry_[step].covariance + share * scatter;
  }

  std::span<const RelativePose> odometry_;
  std::span<const double> duration_s_;
  std::size_t begin_;
  std::size_t end_;
  Columns rate_;
  Columns missed_;
};

/// Where a stretch leads when one of its steps is another than odometry says.
class Detours {
 public:
  explicit Detours(std::span<const RelativePose> steps) : before_(steps.size() + 1, kNoWay), after_(before_) {
    for (std::size_t k = 0; k < steps.size(); ++k) before_[k + 1] = compound(before_[k], steps[k]);
    for (std::size_t k = steps.size(); k-- > 0;) after_[k] = compound(steps[k], after_[k + 1]);
  }

  [[nodiscard]] const RelativePose& way() const { return before_.back(); }
  [[nodiscard]] RelativePose with(std::size_t k, const RelativePose& step) const {
    return compound(compound(before_[k], step), after_[k + 1]);
  }

 private:
  static inline const RelativePose kNoWay{.T_a_b = {}, .covariance = Matrix6d::Zero()};
  std::vector<RelativePose> before_;
  std::vector<RelativePose> after_;
};

}  // namespace

std::optional<OdometryJump> find_jump(std::span<const RelativePose> odometry, std::size_t begin, std::size_t end,
                                      const RelativePose& begin_end, std::span<const double> duration_s) {
  TUTTI_CHECK(begin <= end && end <= odometry.size(), "steps {} to {} of {}", begin, end, odometry.size());
  TUTTI_CHECK(duration_s.empty() || duration_s.size() == odometry.size(), "{} durations of {} steps", duration_s.size(),
              odometry.size());
  const Detours detours(odometry.subspan(begin, end - begin));
  if (begin == end || !(squared_distance(detours.way(), begin_end) > kJumpGap)) return std::nullopt;
  const Rates rates(odometry, duration_s, begin, end);
  std::optional<OdometryJump> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = begin; k < end; ++k) {
    const auto guess = rates.guess(k);
    if (!guess || guess->strangeness < kLeastStrange) continue;
    const RelativePose unsure{odometry[k].T_a_b, guess->motion.covariance};
    const double doubted = squared_distance(detours.with(k - begin, unsure), begin_end);
    const double repaired = squared_distance(detours.with(k - begin, guess->motion), begin_end);
    const bool jumped = doubted > kJumpGap && repaired <= kExplained * doubted &&
                        guess->strangeness * doubted >= kLeastEvidence * repaired;
    if (!jumped || repaired >= least) continue;
    best = OdometryJump{k, guess->motion};
    least = repaired;
  }
  return best;
}

}  // namespace tutti::estimation
