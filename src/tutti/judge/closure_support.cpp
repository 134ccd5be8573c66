// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/closure_support.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <utility>

#include "tutti/base/chi_square.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::judge {
namespace {

/// A closure from the segment with the smaller number to the other; within one segment from the earlier node.
struct Directed {
  std::size_t from = 0;
  std::size_t to = 0;
  RelativePose measurement;
  double turn_variance = 0.0;
};

class Agreement {
 public:
  Agreement(const OdometryTrajectories& odometry, const OutlierRejectionConfig& config)
      : odometry_(odometry), limit_(chi_square_quantile(config.confidence, 6)) {}

  [[nodiscard]] Directed directed(const PoseGraphEdge& closure) const {
    Directed out{closure.from, closure.to, {closure.T_from_to, inverse_of(closure.information)}};
    if (closure.to < closure.from) out = {closure.to, closure.from, inverse(out.measurement)};
    out.turn_variance = out.measurement.covariance.bottomRightCorner<3, 3>().trace();
    return out;
  }

  [[nodiscard]] bool agree(const Directed& a, const Directed& b) const {
    const Pose3 T_one = odometry_.T(a.from, b.from), T_two = odometry_.T(a.to, b.to);
    const Vector6d missed = local(a.measurement.T_a_b * T_two, T_one * b.measurement.T_a_b);
    // No direction's variance exceeds the trace: this alone decides nearly all that do not agree.
    const double turn_variance = a.turn_variance + b.turn_variance + odometry_.turn_variance(a.from, b.from) +
                                 odometry_.turn_variance(a.to, b.to);
    if (missed.tail<3>().squaredNorm() > limit_ * turn_variance) return false;
    const Matrix6d over_two = adjoint(T_two.inverse()), over_second = adjoint(b.measurement.T_a_b.inverse());
    const Matrix6d covariance = odometry_.between(a.to, b.to).covariance + b.measurement.covariance +
                                over_second * odometry_.between(a.from, b.from).covariance * over_second.transpose() +
                                over_two * a.measurement.covariance * over_two.transpose();
    return squared_distance(missed, covariance) <= limit_;
  }

  [[nodiscard]] bool fits_odometry(const Directed& closure) const {
    if (odometry_.segment(closure.from) != odometry_.segment(closure.to)) return false;
    const RelativePose between = odometry_.between(closure.from, closure.to);
    const Vector6d missed = local(closure.measurement.T_a_b, between.T_a_b);
    return squared_distance(missed, between.covariance + closure.measurement.covariance) <= limit_;
  }

 private:
  const OdometryTrajectories& odometry_;
  double limit_;
};

}  // namespace

std::vector<bool> supported_closures(const OdometryTrajectories& odometry, std::span<const PoseGraphEdge> closures,
                                     const OutlierRejectionConfig& config) {
  const Agreement agreement(odometry, config);
  std::vector<Directed> all;
  std::vector<int> support(closures.size(), 0);
  std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> by_segments;
  for (std::size_t c = 0; c < closures.size(); ++c) {
    all.push_back(agreement.directed(closures[c]));
    if (agreement.fits_odometry(all[c])) support[c] = config.least_support;
    by_segments[{odometry.segment(all[c].from), odometry.segment(all[c].to)}].push_back(c);
  }
  const auto is_open = [&](std::size_t c) { return support[c] < config.least_support; };
  for (const auto& [segments, members] : by_segments) {
    const auto count = [](const auto& of) { return static_cast<int>(of.size()); };
    if (segments.first != segments.second && count(members) < config.min_joining_closures) continue;
    // Where there are too few others, those there are must do.
    for (const std::size_t c : members) support[c] += std::max(0, config.least_support - count(members) + 1);
    for (std::size_t k = 0; k < members.size(); ++k)
      for (std::size_t m = k + 1; m < members.size(); ++m) {
        const std::size_t a = members[k], b = members[m];
        if ((!is_open(a) && !is_open(b)) || !agreement.agree(all[a], all[b])) continue;
        ++support[a];
        ++support[b];
      }
  }
  std::vector<bool> out;
  for (std::size_t c = 0; c < closures.size(); ++c) out.push_back(!is_open(c));
  return out;
}

}  // namespace tutti::judge
