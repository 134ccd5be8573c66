// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "tutti/model/trajectory.hpp"
#include "tutti/perception/fit/scan_step.hpp"

namespace tutti::fit {

/// How the scans' motion follows from odometry's (fit_odometry()).
struct MotionModel {
  Pose3 E;                                               ///< Error of the stated LiDAR pose: stated = E * true.
  double offset_s = 0.0;                                 ///< Added to the scans' stamps: odometry's time.
  double log_scale = 0.0;                                ///< The logarithm of the factor on odometry's translations.
  Eigen::Vector3d turn_per_m = Eigen::Vector3d::Zero();  ///< rad/m, in the body, added to odometry's turns.
};

inline constexpr int kParameters = 11;  // E: translation, rotation; offset_s; log_scale; turn_per_m
using Parameters = Eigen::Matrix<double, kParameters, 1>;
using Information = Eigen::Matrix<double, kParameters, kParameters>;

MotionModel moved(const MotionModel& model, const Parameters& step);

/// Steps of the scans with the roots of their informations.
struct WeighedSteps {
  std::vector<ScanStep> steps;
  std::vector<Matrix6d> root;  ///< L^-1 where L L^T is the covariance.
};
WeighedSteps weigh(std::span<const ScanStep> steps);

/// Squared Mahalanobis distances above this count less and less (Geman-McClure).
inline constexpr double kMostDistance2 = 54.0;

/// Odometry's motion over each step at an offset of the clock; nothing where it is not known.
using Motions = std::vector<std::optional<Pose3>>;
Motions motions(const WeighedSteps& weighed, const Trajectory& odometry, double offset_s);

/// Residual of one step whose motion by odometry is given, of unit covariance.
Vector6d residual(const WeighedSteps& weighed, std::size_t step, const Pose3& motion, const MotionModel& model);

/// Mean over the steps of the robust squared distance; `known`: steps that have a motion.
struct Cost {
  double mean = 0.0;
  std::size_t known = 0;
};
Cost cost_of(const WeighedSteps& weighed, const Motions& motions, const MotionModel& model);

struct Solution {
  MotionModel model;
  Parameters sigma = Parameters::Zero();
  Cost cost;
};
/// Gauss-Newton from `begin`, with weak priors about it on what the steps do not determine. The sigmas are of batches
/// of neighbouring steps, or of the residuals, whichever is larger. Parameters that are `fixed` (1, else 0) stay.
Solution solve(const WeighedSteps& weighed, const Trajectory& odometry, const MotionModel& begin,
               const Parameters& fixed = Parameters::Zero());

/// The rotation R that takes odometry's motions best to the scans' (R t_odometry ~ t_scans, the same for rotation
/// vectors), in closed form [Kabsch 1976].
Eigen::Quaterniond best_rotation(const WeighedSteps& weighed, const Motions& motions);

}  // namespace tutti::fit
