// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/receiver.hpp"

#include <cmath>
#include <numbers>

#include "tutti/geometry/so3.hpp"
#include "tutti/model/pose_at.hpp"

namespace tutti::simulation {
namespace {

using Eigen::Vector3d;

Vector3d vector_of(const std::vector<double>& numbers) {
  return numbers.size() == 3 ? Vector3d(numbers[0], numbers[1], numbers[2]) : Vector3d::Zero();
}

/// Errors of one receiver, fix after fix.
class Errors {
 public:
  Errors(const ReceiverConfig& config, const Rng& rng)
      : config_(config), noise_(rng.fork("noise")), wrong_(rng.fork("wrong")) {}

  /// `step_s` since the last.
  Vector3d next(double step_s) {
    const Vector3d sigma(config_.sigma_m, config_.sigma_m, config_.sigma_up_m);
    const double kept = is_first_ || config_.correlation_s <= 0.0 ? 0.0 : std::exp(-step_s / config_.correlation_s);
    is_first_ = false;
    const Vector3d drawn(noise_.normal(), noise_.normal(), noise_.normal());
    slow_ = kept * slow_ + std::sqrt(1.0 - kept * kept) * sigma.cwiseProduct(drawn);
    left_s_ -= step_s;
    if (left_s_ <= 0.0) {
      const double angle = wrong_.uniform(0.0, 2.0 * std::numbers::pi);
      is_wrong_ = wrong_.bernoulli(config_.wrong_share);
      off_ = config_.wrong_m * Vector3d(std::cos(angle), std::sin(angle), 0.0);
      left_s_ = config_.wrong_lasts_s;
    }
    return is_wrong_ ? Vector3d(slow_ + off_) : slow_;
  }

 private:
  const ReceiverConfig& config_;
  Rng noise_, wrong_;
  bool is_first_ = true, is_wrong_ = false;
  double left_s_ = 0.0;
  Vector3d slow_ = Vector3d::Zero(), off_ = Vector3d::Zero();
};

}  // namespace

std::vector<PositionFix> simulate_fixes(const Trajectory& truth, const ReceiverConfig& config, const PlaceConfig& place,
                                        const Rng& rng) {
  std::vector<PositionFix> out;
  if (truth.empty()) return out;
  const Vector3d antenna = vector_of(config.antenna_m);
  const Pose3 T_ecef_enu = enu_in_ecef({place.latitude_deg, place.longitude_deg, place.height_m});
  const Pose3 T_enu_truth{Eigen::Quaterniond(Eigen::AngleAxisd(place.yaw_deg * kRadPerDeg, Vector3d::UnitZ())),
                          Vector3d::Zero()};
  const double stated = config.stated_factor, step_s = 1.0 / config.rate_hz;
  const double east = std::pow(stated * config.sigma_m, 2), up = std::pow(stated * config.sigma_up_m, 2);
  Errors errors(config, rng);
  for (int k = 0;; ++k) {
    const double after_s = k * step_s;
    const Timestamp stamp = truth.front().stamp + after_s;
    if (stamp > truth.back().stamp) return out;
    const Vector3d error = errors.next(step_s);
    if (config.outage_s.size() == 2 && after_s >= config.outage_s[0] && after_s < config.outage_s[1]) continue;
    const auto pose = pose_at(truth, stamp);
    if (!pose) continue;
    PositionFix fix{.stamp = stamp + config.clock_offset_s};
    fix.antenna = geodetic_of(T_ecef_enu * (T_enu_truth * (*pose * antenna) + error));
    if (config.swapped) std::swap(fix.antenna.latitude_deg, fix.antenna.longitude_deg);
    fix.covariance = Vector3d(east, east, up).asDiagonal();
    if (config.antenna_told) fix.p_body_antenna = antenna;
    out.push_back(fix);
  }
}

}  // namespace tutti::simulation
