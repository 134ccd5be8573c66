// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/internal/motion_model.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::fit {
namespace {

constexpr int kIterations = 10;
constexpr std::size_t kBatches = 12;
// Standard deviations of what a robot's set-up and odometry are off by.
const Parameters kPrior = (Parameters() << 2.0, 2.0, 2.0, 1.0, 1.0, 1.0, 1.0, 0.3, 0.02, 0.02, 0.02).finished();
const Parameters kDifference =
    (Parameters() << 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-3, 1e-4, 1e-4, 1e-4, 1e-4).finished();
constexpr int kOffset = 6;

double loss_weight(double distance2) {
  const double w = 1.0 / (1.0 + distance2 / kMostDistance2);
  return w * w;
}

/// The sums of one linearisation.
struct Linearised {
  Information H = Information::Zero();
  Parameters g = Parameters::Zero();
  std::vector<Parameters> scores;  // per known step, g is their sum
  double weights = 0.0, squares = 0.0;
};

Linearised linearise(const WeighedSteps& weighed, const Trajectory& odometry, const MotionModel& model) {
  Linearised out;
  const Motions now = motions(weighed, odometry, model.offset_s);
  const Motions later = motions(weighed, odometry, model.offset_s + kDifference[kOffset]);
  for (std::size_t k = 0; k < weighed.steps.size(); ++k) {
    if (!now[k] || !later[k]) continue;
    const Vector6d r = residual(weighed, k, *now[k], model);
    Eigen::Matrix<double, 6, kParameters> J;
    for (int p = 0; p < kParameters; ++p) {
      Parameters step = Parameters::Zero();
      step[p] = kDifference[p];
      J.col(p) = (residual(weighed, k, p == kOffset ? *later[k] : *now[k], moved(model, step)) - r) / kDifference[p];
    }
    const double w = loss_weight(r.squaredNorm());
    out.H += w * J.transpose() * J;
    out.scores.push_back(w * J.transpose() * r);
    out.g += out.scores.back();
    out.weights += w;
    out.squares += w * r.squaredNorm();
  }
  return out;
}

Parameters sigmas(const Linearised& at, const Information& information) {
  const Information inverse = information.inverse();
  Information scatter = Information::Zero();
  const std::size_t n = at.scores.size();
  for (std::size_t b = 0; b < kBatches; ++b) {
    Parameters sum = Parameters::Zero();
    for (std::size_t k = b * n / kBatches; k < (b + 1) * n / kBatches; ++k) sum += at.scores[k];
    scatter += sum * sum.transpose();
  }
  const Information by_batches = inverse * scatter * inverse * (double{kBatches} / (kBatches - 1.0));
  const double variance = at.squares / std::max(1.0, 6.0 * at.weights - kParameters);
  return (by_batches.diagonal().cwiseMax(variance * inverse.diagonal())).cwiseSqrt();
}

}  // namespace

MotionModel moved(const MotionModel& model, const Parameters& step) {
  MotionModel out = model;
  out.E.translation += step.head<3>();
  out.E.rotation = (so3_exp(step.segment<3>(3)) * model.E.rotation).normalized();
  out.offset_s += step[kOffset];
  out.log_scale += step[7];
  out.turn_per_m += step.tail<3>();
  return out;
}

WeighedSteps weigh(std::span<const ScanStep> steps) {
  WeighedSteps out;
  for (const ScanStep& step : steps) {
    if (!is_definite(step.covariance)) continue;
    out.steps.push_back(step);
    out.root.push_back(root_of_inverse(step.covariance));
  }
  return out;
}

Motions motions(const WeighedSteps& weighed, const Trajectory& odometry, double offset_s) {
  constexpr double kLongestGap_s = 1.0;
  Motions out;
  out.reserve(weighed.steps.size());
  for (const ScanStep& step : weighed.steps) out.push_back(motion_over(step, odometry, offset_s, kLongestGap_s));
  return out;
}

Vector6d residual(const WeighedSteps& weighed, std::size_t step, const Pose3& motion, const MotionModel& model) {
  const double metres = motion.translation.norm();
  const Pose3 body{(motion.rotation * so3_exp(metres * model.turn_per_m)).normalized(),
                   std::exp(model.log_scale) * motion.translation};
  const Pose3 expected = model.E * body * model.E.inverse();
  return weighed.root[step] * local(expected, weighed.steps[step].T_from_to);
}

Cost cost_of(const WeighedSteps& weighed, const Motions& motions, const MotionModel& model) {
  Cost cost;
  for (std::size_t k = 0; k < motions.size(); ++k) {
    if (!motions[k]) continue;
    const double distance2 = residual(weighed, k, *motions[k], model).squaredNorm();
    cost.mean += distance2 / (1.0 + distance2 / kMostDistance2);
    ++cost.known;
  }
  cost.mean /= std::max(1.0, static_cast<double>(cost.known));
  return cost;
}

Solution solve(const WeighedSteps& weighed, const Trajectory& odometry, const MotionModel& begin,
               const Parameters& fixed) {
  constexpr double kFixed = 1e15;  // information
  Solution out{.model = begin};
  const Information prior = (kPrior.cwiseInverse().cwiseAbs2() + kFixed * fixed).asDiagonal();
  for (int k = 0; k < kIterations; ++k) {
    const Linearised at = linearise(weighed, odometry, out.model);
    const Parameters step = (at.H + prior).ldlt().solve(-at.g);
    if (!step.allFinite()) break;
    out.model = moved(out.model, step);
    if ((step.cwiseAbs().array() < kDifference.array()).all()) break;
  }
  const Linearised at = linearise(weighed, odometry, out.model);
  out.sigma = sigmas(at, at.H + prior);
  out.cost = cost_of(weighed, motions(weighed, odometry, out.model.offset_s), out.model);
  return out;
}

Eigen::Quaterniond best_rotation(const WeighedSteps& weighed, const Motions& motions) {
  constexpr double kRelative = 0.25;  // one metre counts as much as 0.25 rad
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < motions.size(); ++k) {
    if (!motions[k]) continue;
    const Pose3& scan = weighed.steps[k].T_from_to;
    sum += kRelative * kRelative * scan.translation * motions[k]->translation.transpose();
    sum += so3_log(scan.rotation) * so3_log(motions[k]->rotation).transpose();
  }
  return Eigen::Quaterniond(project_to_so3(sum));
}

}  // namespace tutti::fit
