// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/odometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/simulation/degrade.hpp"
#include "tutti/simulation/world.hpp"

namespace tutti::simulation {
namespace {

constexpr double kBiasLength_m = 100.0;  // way over which the slowly varying yaw drift forgets itself

double square(double x) { return x * x; }

/// Errors that stay the same, or nearly so, from one increment to the next.
class SlowErrors {
 public:
  SlowErrors(const OdometryNoiseConfig& config, Rng& rng)
      : config_(config),
        scale_(rng.normal(0.01 * config.scale_percent)),
        yaw_drift_(rng.normal(config.yaw_drift_deg_per_m * kRadPerDeg)),
        yaw_bias_(rng.normal(config.yaw_bias_deg_per_m * kRadPerDeg)) {}

  /// Error of an increment of this translation; moves the bias on.
  Vector6d next(const Eigen::Vector3d& translation, Rng& rng) {
    const double distance = translation.norm();
    Vector6d error = Vector6d::Zero();
    error.head<3>() = scale_ * translation;
    error(5) = (yaw_drift_ + yaw_bias_) * distance;
    const double keep = std::exp(-distance / kBiasLength_m);  // exact Gauss-Markov transition
    yaw_bias_ = keep * yaw_bias_ + rng.normal(config_.yaw_bias_deg_per_m * kRadPerDeg * std::sqrt(1.0 - square(keep)));
    return error;
  }

 private:
  const OdometryNoiseConfig& config_;
  double scale_;
  double yaw_drift_;  // rad per metre
  double yaw_bias_;   // rad per metre
};

/// Standard deviations of the independent part of an increment's error.
Vector6d white_sigma(const OdometryNoiseConfig& config, double distance) {
  const double translation = std::sqrt(square(config.translation_m_per_sqrt_m) * distance + square(config.floor_m));
  const auto rotation = [&](double per_sqrt_m) {
    return kRadPerDeg * std::sqrt(square(per_sqrt_m) * distance + square(config.floor_deg));
  };
  const double tilt = rotation(config.tilt_deg_per_sqrt_m);
  const double yaw = rotation(config.yaw_deg_per_sqrt_m);
  return (Vector6d() << translation, translation, translation, tilt, tilt, yaw).finished();
}

Matrix6d honest_covariance(const OdometryNoiseConfig& config, const Eigen::Vector3d& translation) {
  const double distance = translation.norm();
  Matrix6d covariance = white_sigma(config, distance).cwiseAbs2().asDiagonal();
  if (distance > 0.0) {
    const double scale_per_m = square(0.01 * config.scale_percent) * config.consistent_length_m;
    covariance.topLeftCorner<3, 3>() += scale_per_m / distance * translation * translation.transpose();
  }
  const double bias_per_m = 2.0 * square(config.yaw_bias_deg_per_m) * kBiasLength_m +
                            square(config.yaw_drift_deg_per_m) * config.consistent_length_m;
  covariance(5, 5) += square(kRadPerDeg) * bias_per_m * distance;
  return covariance;
}

Vector6d draw_slip(const OdometryNoiseConfig& config, double distance, Rng& rng) {
  const bool slips = rng.bernoulli(1.0 - std::exp(-1e-3 * config.slips_per_km * distance));
  const double x = rng.normal(config.slip_m);
  const double y = rng.normal(config.slip_m);
  const double yaw = rng.normal(config.slip_deg * kRadPerDeg);
  if (!slips) return Vector6d::Zero();
  return (Vector6d() << x, y, 0.0, 0.0, 0.0, yaw).finished();
}

/// A stay in one featureless corridor: increments [from, until).
struct Visit {
  std::size_t from = 0;
  std::size_t until = 0;
  double slide = 0.0;           // error per metre along the axis
  double variance_per_m = 0.0;  // that is honest for the whole visit
};

double trajectory_along(const Trajectory& truth, const Surroundings& at, std::size_t k) {
  return (truth[k + 1].pose.translation - truth[k].pose.translation).dot(at.axis);
}

std::vector<Visit> draw_visits(const Trajectory& truth, std::span<const Surroundings> surroundings,
                               const DegeneracyConfig& config, Rng& rng) {
  std::vector<Visit> visits;
  for (std::size_t k = 0; k + 1 < surroundings.size();) {
    Visit visit{.from = k};
    double way = 0.0;
    for (; k + 1 < surroundings.size() && surroundings[k].corridor == surroundings[visit.from].corridor; ++k)
      way += std::abs(trajectory_along(truth, surroundings[k], k));
    visit.until = k;
    if (surroundings[visit.from].kind != CorridorKind::featureless) continue;
    const double drawn = rng.normal(0.01 * config.slide_percent);
    visit.slide = std::copysign(std::max(std::abs(drawn), 0.01 * config.least_slide_percent), drawn);
    visit.variance_per_m = square(0.01 * config.slide_percent) * way + square(config.along_m_per_sqrt_m);
    visits.push_back(visit);
  }
  return visits;
}

/// Errors that grow evenly with the way while localisation fails: increments [from, until).
struct Failure {
  std::size_t from = 0;
  std::size_t until = 0;
  double yaw_per_m = 0.0;
  Eigen::Vector3d drift_per_m = Eigen::Vector3d::Zero();  // in the frame of the truth

  [[nodiscard]] bool contains(std::size_t increment) const { return from <= increment && increment < until; }
  [[nodiscard]] Vector6d error(const Pose3& T_reference_body, double distance) const {
    Vector6d error = Vector6d::Zero();
    error.head<3>() = distance * (T_reference_body.rotation.conjugate() * drift_per_m);
    error(5) = distance * yaw_per_m;
    return error;
  }
};

std::optional<Failure> draw_failure(const Trajectory& truth, std::span<const Surroundings> surroundings,
                                    const FailureConfig& config, Rng rng) {
  const double side = rng.bernoulli(0.5) ? 1.0 : -1.0;
  const double direction = rng.uniform(-std::numbers::pi, std::numbers::pi);
  if (config.yaw_deg == 0.0 && config.drift_m == 0.0) return std::nullopt;
  std::optional<Failure> failure;
  double outside_m = 0.0;
  for (std::size_t k = 0; k + 1 < surroundings.size(); ++k) {
    const bool inside = surroundings[k].kind != CorridorKind::open;
    if (failure && (inside || outside_m >= config.after_m + config.length_m)) break;
    if (!failure && !inside && outside_m >= config.after_m) failure = Failure{.from = k};
    if (failure) failure->until = k + 1;
    if (!inside) outside_m += (truth[k + 1].pose.translation - truth[k].pose.translation).norm();
  }
  if (!failure) return std::nullopt;
  failure->yaw_per_m = side * config.yaw_deg * kRadPerDeg / config.length_m;
  failure->drift_per_m =
      config.drift_m / config.length_m * Eigen::Vector3d(std::cos(direction), std::sin(direction), 0.0);
  return failure;
}

/// A scripted error that does happen: increments [from, until).
struct ScriptedError {
  std::size_t from = 0;
  std::size_t until = 0;
  double length_m = 0.0;  // 0 = all in one increment
  Eigen::Vector3d move = Eigen::Vector3d::Zero();
  double yaw = 0.0;

  [[nodiscard]] bool contains(std::size_t increment) const { return from <= increment && increment < until; }
  /// Moves are level, turns are about gravity, wherever the gait tilts the body.
  [[nodiscard]] Vector6d error(const Pose3& from_pose, const Pose3& to_pose, double distance) const {
    const double share = length_m > 0.0 ? distance / length_m : 1.0;
    const Eigen::Vector3d x = from_pose.rotation * Eigen::Vector3d::UnitX();
    const Eigen::AngleAxisd heading(std::atan2(x.y(), x.x()), Eigen::Vector3d::UnitZ());
    Vector6d error;
    error << from_pose.rotation.conjugate() * (heading * (share * move)),
        to_pose.rotation.conjugate() * Eigen::Vector3d(0.0, 0.0, share * yaw);
    return error;
  }
};

/// The increment that ends nearest to where the robot started, on its next pass; nothing when it does not come back.
std::optional<std::size_t> next_pass_of_start(const Trajectory& truth, std::size_t increment) {
  constexpr double kNear_m = 2.0;
  const auto distance = [&](std::size_t k) {
    return (truth[k + 1].pose.translation - truth[0].pose.translation).norm();
  };
  std::optional<std::size_t> nearest;
  for (std::size_t k = increment; k + 1 < truth.size(); ++k) {
    if (distance(k) > kNear_m) {
      if (nearest) break;
    } else if (!nearest || distance(k) < distance(*nearest)) {
      nearest = k;
    }
  }
  return nearest;
}

std::vector<ScriptedError> place_scripted(const Trajectory& truth, std::span<const ScriptedErrorConfig> scripted) {
  std::vector<double> way = {0.0};  // at every pose
  for (std::size_t k = 0; k + 1 < truth.size(); ++k)
    way.push_back(way[k] + (truth[k + 1].pose.translation - truth[k].pose.translation).norm());
  const auto reached = [&](double metres) {
    return static_cast<std::size_t>(std::ranges::lower_bound(way, metres) - way.begin());
  };
  std::vector<ScriptedError> out;
  for (const ScriptedErrorConfig& config : scripted) {
    std::optional<std::size_t> from = reached(config.after_m);
    if (config.at_start) from = next_pass_of_start(truth, *from);
    if (!from || *from + 1 >= truth.size()) continue;
    const std::size_t end = config.length_m > 0.0 ? reached(way[*from] + config.length_m) : *from + 1;
    out.push_back({.from = *from,
                   .until = std::min(end, truth.size() - 1),
                   .length_m = config.length_m,
                   .move = {config.ahead_m, config.left_m, config.up_m},
                   .yaw = config.yaw_deg * kRadPerDeg});
  }
  return out;
}

/// The error of an increment, and the covariance that the robot states; translations in the frame of its start.
struct IncrementError {
  Vector6d error;
  Matrix6d covariance;
};

/// All that goes wrong along one run, increment by increment.
class RunErrors {
 public:
  RunErrors(const Trajectory& truth, std::span<const Surroundings> surroundings, const OdometryNoiseConfig& config,
            const Rng& rng)
      : truth_(truth),
        surroundings_(surroundings),
        config_(config),
        slow_rng_(rng.fork("slow")),
        white_rng_(rng.fork("white")),
        slip_rng_(rng.fork("slips")),
        slide_rng_(rng.fork("slides")),
        slow_(config, slow_rng_),
        visits_(draw_visits(truth, surroundings, config.degeneracy, slide_rng_)),
        failure_(draw_failure(truth, surroundings, config.failure, rng.fork("failure"))),
        scripted_(place_scripted(truth, config.scripted)) {}

  /// The error of increment k; call in order.
  IncrementError next(std::size_t k, const Eigen::Vector3d& translation) {
    const double distance = translation.norm();
    IncrementError out{white_sigma(config_, distance), honest_covariance(config_, translation)};
    for (double& e : out.error) e *= white_rng_.normal();
    out.error += slow_.next(translation, slow_rng_);
    const Vector6d slip = draw_slip(config_, distance, slip_rng_);
    if (!slip.isZero(0.0)) slips_.push_back(k);
    out.error += slip;
    if (failure_ && failure_->contains(k)) out.error += failure_->error(truth_[k].pose, distance);
    for (const ScriptedError& scripted : scripted_)
      if (scripted.contains(k)) out.error += scripted.error(truth_[k].pose, truth_[k + 1].pose, distance);
    while (visit_ < visits_.size() && visits_[visit_].until <= k) ++visit_;
    if (visit_ < visits_.size() && visits_[visit_].from <= k) slide(visits_[visit_], k, out);
    out.covariance *= square(config_.stated_sigma_factor);
    return out;
  }

  /// Where it went wrong, in time order; sizes from what came of it.
  [[nodiscard]] std::vector<DriftOrigin> origins(const Trajectory& odometry) const {
    std::vector<DriftOrigin> out;
    const auto add = [&](DriftOrigin::Kind kind, std::size_t from, std::size_t until) {
      const Vector6d error =
          local(truth_[from].pose.inverse() * truth_[until].pose, odometry[from].pose.inverse() * odometry[until].pose);
      out.push_back({kind, truth_[from].stamp, truth_[until].stamp, error.head<3>().norm(), error.tail<3>().norm()});
    };
    for (const std::size_t k : slips_) add(DriftOrigin::Kind::slip, k, k + 1);
    for (const Visit& visit : visits_) add(DriftOrigin::Kind::degeneracy, visit.from, visit.until);
    if (failure_) add(DriftOrigin::Kind::failure, failure_->from, failure_->until);
    for (const ScriptedError& s : scripted_)
      add(s.length_m > 0.0 ? DriftOrigin::Kind::failure : DriftOrigin::Kind::slip, s.from, s.until);
    std::ranges::stable_sort(out, {}, &DriftOrigin::from);
    return out;
  }

 private:
  void slide(const Visit& visit, std::size_t k, IncrementError& out) {
    const Eigen::Vector3d axis = truth_[k].pose.rotation.conjugate() * surroundings_[k].axis;
    const double way = trajectory_along(truth_, surroundings_[k], k);
    const double walk = slide_rng_.normal(config_.degeneracy.along_m_per_sqrt_m * std::sqrt(std::abs(way)));
    out.error.head<3>() += (visit.slide * way + walk) * axis;
    out.covariance.topLeftCorner<3, 3>() += visit.variance_per_m * std::abs(way) * axis * axis.transpose();
  }

  const Trajectory& truth_;
  std::span<const Surroundings> surroundings_;
  const OdometryNoiseConfig& config_;
  Rng slow_rng_, white_rng_, slip_rng_, slide_rng_;
  SlowErrors slow_;
  std::vector<Visit> visits_;
  std::size_t visit_ = 0;
  std::optional<Failure> failure_;
  std::vector<ScriptedError> scripted_;
  std::vector<std::size_t> slips_;
};

}  // namespace

std::vector<Surroundings> surroundings_along(const CorridorWorld& world, const Trajectory& truth) {
  std::vector<Surroundings> out;
  out.reserve(truth.size());
  for (const StampedPose& sample : truth) {
    const auto at = corridor_at(world, sample.pose.translation, std::numeric_limits<double>::infinity());
    TUTTI_CHECK(at.has_value(), "a world without corridors");
    const Corridor& corridor = world.corridors[*at];
    out.push_back({.kind = corridor.kind,
                   .corridor = *at,
                   .axis = (world.junctions[corridor.b] - world.junctions[corridor.a]).normalized()});
  }
  return out;
}

const std::vector<OdometryKind>& odometry_kinds() {
  static const std::vector<OdometryKind> rows{
      {"honest", "drifts by a few thousandths of the distance, as it says", {}},
      {"better",
       "twenty times better than it says",
       {.translation_m_per_sqrt_m = 0.0005,
        .yaw_deg_per_sqrt_m = 0.0025,
        .tilt_deg_per_sqrt_m = 0.0005,
        .floor_m = 0.000005,
        .floor_deg = 0.00005,
        .yaw_bias_deg_per_m = 0.00015,
        .scale_percent = 0.01,
        .stated_sigma_factor = 20.0}},
      {"precise",
       "a third of honest's random walk, and less drift",
       {.translation_m_per_sqrt_m = 0.003,
        .yaw_deg_per_sqrt_m = 0.01,
        .tilt_deg_per_sqrt_m = 0.005,
        .yaw_bias_deg_per_m = 0.0005,
        .scale_percent = 0.03}},
      {"unsure",
       "twice honest's random walk of position, and says three times as much as there is",
       {.translation_m_per_sqrt_m = 0.02, .stated_sigma_factor = 3.0}},
      {"drifting", "yaw drifts ten times as much as honest's", {.yaw_bias_deg_per_m = 0.03, .scale_percent = 0.5}},
      {"legged",
       "slips twice in a kilometre, slides along featureless corridors",
       {.slips_per_km = 2.0, .degeneracy = {.slide_percent = 1.8, .along_m_per_sqrt_m = 0.03}}},
      {"stumbling",
       "slips six times in a kilometre, slides, and its yaw drifts by a tenth of a degree in a metre",
       {.yaw_bias_deg_per_m = 0.1,
        .scale_percent = 0.5,
        .slips_per_km = 6.0,
        .slip_deg = 0.5,
        .degeneracy = {.slide_percent = 2.5, .along_m_per_sqrt_m = 0.03}}},
      {"sliding",
       "slides by 3 % or more along featureless corridors",
       {.degeneracy = {.slide_percent = 5.0, .least_slide_percent = 3.0, .along_m_per_sqrt_m = 0.03}}},
      {"failing",
       "turns by 5.8 degrees over 30 m in the open, which its covariance does not show",
       {.failure = {.after_m = 30.0, .length_m = 30.0, .yaw_deg = 5.8}}},
      {"visual",
       "as visual-inertial odometry of a flight",
       {.translation_m_per_sqrt_m = 0.02,
        .yaw_deg_per_sqrt_m = 0.25,
        .tilt_deg_per_sqrt_m = 0.05,
        .yaw_bias_deg_per_m = 0.18,
        .scale_percent = 0.5}},
  };
  return rows;
}

OdometryNoiseConfig OdometryChoice::config() const {
  const OdometryKind* row = row_of(odometry_kinds(), kind);
  TUTTI_CHECK(row != nullptr, "odometry '{}'", kind);
  OdometryNoiseConfig out = row->config;
  const auto set = [](double& number, const std::optional<double>& given) { number = given.value_or(number); };
  set(out.translation_m_per_sqrt_m, translation_m_per_sqrt_m);
  set(out.yaw_deg_per_sqrt_m, yaw_deg_per_sqrt_m);
  set(out.yaw_bias_deg_per_m, yaw_bias_deg_per_m);
  set(out.scale_percent, scale_percent);
  set(out.slips_per_km, slips_per_km);
  set(out.slip_deg, slip_deg);
  set(out.degeneracy.slide_percent, slide_percent);
  out.scripted = scripted;
  return out;
}

OdometrySimulation simulate_odometry(const Trajectory& truth, std::span<const Surroundings> surroundings,
                                     const OdometryNoiseConfig& config, Rng rng) {
  TUTTI_CHECK(surroundings.empty() || surroundings.size() == truth.size(), "{} surroundings, {} poses",
              surroundings.size(), truth.size());
  OdometrySimulation result;
  if (truth.empty()) return result;
  RunErrors errors(truth, surroundings, config, rng);
  Rng frame_rng = rng.fork("frame");
  result.odometry.reserve(truth.size());
  result.increment_covariance.reserve(truth.size() - 1);
  result.odometry.push_back({truth.front().stamp, random_frame(frame_rng)});
  for (std::size_t k = 0; k + 1 < truth.size(); ++k) {
    const Pose3 increment = truth[k].pose.inverse() * truth[k + 1].pose;
    auto [error, covariance] = errors.next(k, increment.translation);
    // The translation part of both is meant in the frame of the increment's start; the tangent is its end's.
    const Eigen::Matrix3d R = increment.rotation.toRotationMatrix();
    error.head<3>() = (R.transpose() * error.head<3>()).eval();
    covariance.topLeftCorner<3, 3>() = (R.transpose() * covariance.topLeftCorner<3, 3>() * R).eval();
    result.odometry.push_back({truth[k + 1].stamp, result.odometry.back().pose * retract(increment, error)});
    result.increment_covariance.push_back(0.5 * (covariance + covariance.transpose()));
  }
  result.drift_origins = errors.origins(result.odometry);
  return result;
}

}  // namespace tutti::simulation
