// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/failure_interval.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::estimation {
namespace {

/// Intervals begin and end at poses this far (m) apart at least, and at no more than so many.
constexpr double kSpacing = 1.0;
constexpr double kMostEnds = 60.0;
/// What a sighting costs at most (-2 log likelihood, against one that is as sure as its covariance says): a wrong one
/// may be anywhere within some 10 m and 1 rad.
constexpr double kWrong = 40.0;
/// Failures grow at a rate of what was missed, at least this (m, rad), over one of these lengths (m).
constexpr std::array kGrowth{4.0, 12.0, 36.0};
constexpr double kLeastTranslation = 0.1;
constexpr double kLeastRotation = 0.5 * kRadPerDeg;
/// They grow evenly but for a random walk of this share.
constexpr double kUneven = 0.1;
/// Intervals are this long (m) on average, as far as one knows without looking.
constexpr double kUsualLength = 100.0;

/// A pose, and by how much per metre odometry misses it, with their covariance (right tangent).
struct Belief {
  Pose3 mean;
  Matrix6d covariance;
  Vector6d rate = Vector6d::Zero();
  Matrix6d rate_covariance = Matrix6d::Zero();
  Matrix6d pose_rate = Matrix6d::Zero();

  /// Along odometry, over a way of so many metres on which it fails.
  void advance(const RelativePose& step, double failing_m = 0.0) {
    mean = mean * step.T_a_b;
    covariance = compound_covariance(step.T_a_b, covariance, step.covariance);
    if (failing_m == 0.0) return;
    mean = retract(mean, failing_m * rate);
    pose_rate = (adjoint(step.T_a_b.inverse()) * pose_rate).eval();
    covariance += failing_m * (pose_rate + pose_rate.transpose()) + failing_m * failing_m * rate_covariance;
    pose_rate += failing_m * rate_covariance;
  }
};

/// Squared error and log-determinant of what two independent opinions differ by.
struct Difference {
  Vector6d error;
  Eigen::LLT<Matrix6d> covariance;
  double cost = 0.0;  ///< chi2 + log det

  Difference(const Belief& a, const Pose3& b, const Matrix6d& b_covariance)
      : error(local(a.mean, b)), covariance(a.covariance + b_covariance) {
    cost = error.dot(covariance.solve(error)) + log_det(covariance);
  }
  static double log_det(const Eigen::LLT<Matrix6d>& llt) {
    return 2.0 * llt.matrixLLT().diagonal().array().log().sum();
  }
};

struct Station {
  std::size_t at = 0;
  double way = 0.0;
  bool is_end = false;  ///< Of an interval, maybe.
  struct Sighted {
    Pose3 T_world_body;
    Matrix6d covariance;
    double log_det = 0.0;
  };
  std::vector<Sighted> sighted;

  /// Takes the sightings in as far as they fit; their cost.
  double observe(Belief& belief) const {
    double cost = 0.0;
    for (const Sighted& s : sighted) {
      const Difference d(belief, s.T_world_body, s.covariance);
      const double fits = d.cost - s.log_det;
      if (!(fits < kWrong)) {
        cost += kWrong;
        continue;
      }
      cost += fits;
      const Matrix6d gain = d.covariance.solve(belief.covariance).transpose();
      const Matrix6d rate_gain = d.covariance.solve(belief.pose_rate).transpose();
      belief.mean = retract(belief.mean, gain * d.error);
      belief.rate += rate_gain * d.error;
      belief.rate_covariance -= rate_gain * belief.pose_rate;
      belief.pose_rate -= gain * belief.pose_rate;
      belief.covariance -= gain * belief.covariance;
      belief.covariance = (0.5 * (belief.covariance + belief.covariance.transpose())).eval();
    }
    return cost;
  }
};

struct Message {
  Belief belief;
  double cost = 0.0;
};

class Window {
 public:
  Window(std::span<const Pose3> T_odom_body, std::span<const Matrix6d> step_covariance,
         std::span<const PoseSighting> sightings) {
    place_stations(T_odom_body, sightings);
    for (std::size_t s = 1; s < stations_.size(); ++s) {
      RelativePose step{.T_a_b = {}, .covariance = Matrix6d::Zero()};
      for (std::size_t k = stations_[s - 1].at; k < stations_[s].at; ++k)
        step = compound(step, {T_odom_body[k].inverse() * T_odom_body[k + 1], step_covariance[k]});
      steps_.push_back(step);
    }
    send_messages();
    measure_missed();
  }

  [[nodiscard]] std::optional<FailureInterval> locate() const {
    const std::size_t n = stations_.size();
    Eigen::MatrixXd cost = Eigen::MatrixXd::Constant(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n),
                                                     std::numeric_limits<double>::infinity());
    for (const double growth_m : kGrowth)
      for (std::size_t b = 0; b + 1 < n; ++b)
        if (stations_[b].is_end) weigh_from(b, growth_m, cost);
    Eigen::Index b = 0;
    Eigen::Index e = 0;
    const double least = cost.minCoeff(&b, &e);
    if (!std::isfinite(least)) return std::nullopt;
    const Eigen::MatrixXd weight = (-0.5 * (cost.array() - least)).exp();
    // Rows: begins, columns: ends; an interval overlaps the most likely one when it begins before that ends.
    const Eigen::MatrixXd overlapping = weight.topRightCorner(e, static_cast<Eigen::Index>(n) - b - 1);
    const auto begin = median(overlapping.rowwise().sum());
    const auto end = median(overlapping.colwise().sum().transpose()) + static_cast<std::size_t>(b) + 1;
    return FailureInterval{stations_[begin].at, stations_[std::max(begin + 1, end)].at, missed_m_, missed_rad_};
  }

 private:
  static std::size_t median(const Eigen::VectorXd& weight) {
    double left = 0.5 * weight.sum();
    Eigen::Index k = 0;
    while (k + 1 < weight.size() && left > weight(k)) left -= weight(k++);
    return static_cast<std::size_t>(k);
  }

  void place_stations(std::span<const Pose3> poses, std::span<const PoseSighting> sightings) {
    std::vector<double> way{0.0};
    for (std::size_t k = 1; k < poses.size(); ++k)
      way.push_back(way.back() + (poses[k].translation - poses[k - 1].translation).norm());
    const double spacing = std::max(kSpacing, way.back() / kMostEnds);
    double next_end = 0.0;
    auto sighting = sightings.begin();
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const bool sighted = sighting != sightings.end() && sighting->at == k;
      const bool is_end = way[k] >= next_end || k + 1 == poses.size();
      if (!sighted && !is_end) continue;
      if (is_end) next_end = way[k] + spacing;
      stations_.push_back({.at = k, .way = way[k], .is_end = is_end, .sighted = {}});
      for (; sighting != sightings.end() && sighting->at == k; ++sighting)
        stations_.back().sighted.push_back({sighting->T_world_body, sighting->covariance,
                                            Difference::log_det(Eigen::LLT<Matrix6d>(sighting->covariance))});
    }
    TUTTI_CHECK(sighting == sightings.end(), "sightings not sorted or beyond the {} poses", poses.size());
  }

  /// With odometry trusted: forward_[k] from the first sighting on up to station k, backward_[k] from the last one back
  /// to it.
  void send_messages() {
    const std::size_t n = stations_.size();
    const auto& first = stations_.front().sighted.front();
    const auto& last = stations_.back().sighted.back();
    forward_.assign(n, {{first.T_world_body, first.covariance}, 0.0});
    backward_.assign(n, {{last.T_world_body, last.covariance}, 0.0});
    for (std::size_t k = 1; k < n; ++k) {
      forward_[k] = forward_[k - 1];
      forward_[k].belief.advance(steps_[k - 1]);
      forward_[k].cost += stations_[k].observe(forward_[k].belief);
    }
    for (std::size_t k = n - 1; k-- > 0;) {
      backward_[k] = backward_[k + 1];
      backward_[k].belief.advance(inverse(steps_[k]));
      backward_[k].cost += stations_[k].observe(backward_[k].belief);
    }
  }

  /// How much odometry missed: seen from where that is least.
  void measure_missed() {
    missed_m_ = std::numeric_limits<double>::infinity();
    Pose3 T_w_k = stations_.front().sighted.front().T_world_body;
    Pose3 T_w_last = T_w_k;
    for (const RelativePose& step : steps_) T_w_last = T_w_last * step.T_a_b;
    const Pose3 moved = stations_.back().sighted.back().T_world_body * T_w_last.inverse();
    missed_rad_ = std::max(rotation_angle(moved), kLeastRotation);
    for (std::size_t k = 0; k < stations_.size(); ++k) {
      missed_m_ = std::min(missed_m_, (moved * T_w_k.translation - T_w_k.translation).norm());
      if (k < steps_.size()) T_w_k = T_w_k * steps_[k].T_a_b;
    }
    missed_m_ = std::max(missed_m_, kLeastTranslation);
  }

  /// All intervals that begin at station b; adds their weights to those of other growths.
  void weigh_from(std::size_t b, double growth_m, Eigen::MatrixXd& cost) const {
    Message message = forward_[b];
    Vector6d missed;
    missed << Eigen::Vector3d::Constant(missed_m_), Eigen::Vector3d::Constant(missed_rad_);
    message.belief.rate_covariance = (missed / growth_m).array().square().matrix().asDiagonal();
    for (std::size_t e = b + 1; e < stations_.size(); ++e) {
      const double length = stations_[e].way - stations_[e - 1].way;
      RelativePose step = steps_[e - 1];
      step.covariance.diagonal().array() += (kUneven * missed).array().square() * (length / growth_m);
      message.belief.advance(step, length);
      if (stations_[e].is_end) {
        const Belief& after = backward_[e].belief;
        const double met = Difference(message.belief, after.mean, after.covariance).cost;
        const double total =
            message.cost + met + backward_[e].cost + 2.0 * (stations_[e].way - stations_[b].way) / kUsualLength;
        double& sum = cost(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(e));
        const double least = std::min(sum, total);
        if (std::isfinite(least))
          sum = least - 2.0 * std::log(std::exp(-0.5 * (sum - least)) + std::exp(-0.5 * (total - least)));
      }
      message.cost += stations_[e].observe(message.belief);
    }
  }

  std::vector<Station> stations_;
  std::vector<RelativePose> steps_;
  std::vector<Message> forward_;
  std::vector<Message> backward_;
  double missed_m_ = 0.0;
  double missed_rad_ = 0.0;
};

}  // namespace

std::optional<FailureInterval> locate_failure(std::span<const Pose3> T_odom_body,
                                              std::span<const Matrix6d> step_covariance,
                                              std::span<const PoseSighting> sightings) {
  if (T_odom_body.size() < 3) return std::nullopt;
  TUTTI_CHECK(step_covariance.size() + 1 == T_odom_body.size(), "{} poses, {} covariances", T_odom_body.size(),
              step_covariance.size());
  TUTTI_CHECK(sightings.size() >= 2 && sightings.front().at == 0 && sightings.back().at + 1 == T_odom_body.size(),
              "the first and the last pose must be sighted");
  return Window(T_odom_body, step_covariance, sightings).locate();
}

}  // namespace tutti::estimation
