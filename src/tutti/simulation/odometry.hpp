// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::simulation {

/// Errors of an odometry that knows gravity: yaw drifts more than tilt. All are standard deviations; the constants of
/// one run (scale, yaw drift) are drawn once from them.
struct OdometryNoiseConfig {
  double translation_m_per_sqrt_m = 0.01;
  double yaw_deg_per_sqrt_m = 0.05;
  double tilt_deg_per_sqrt_m = 0.01;
  double floor_m = 1e-4;
  double floor_deg = 1e-3;
  double yaw_bias_deg_per_m = 0.003;
  double bias_length_m = 100.0;
  double yaw_drift_deg_per_m = 0.0;
  double scale_percent = 0.2;
  double consistent_length_m = 50.0;
  double slips_per_km = 0.0;
  double slip_m = 1.0;
  double slip_deg = 10.0;
  double start_tilt_deg = 3.0;
  double start_shift_m = 50.0;
  template <class V>
  void describe(V& v) {
    v.field("translation_m_per_sqrt_m", translation_m_per_sqrt_m, at_least(0.0), "Random walk of position, per axis.");
    v.field("yaw_deg_per_sqrt_m", yaw_deg_per_sqrt_m, at_least(0.0), "Random walk of yaw.");
    v.field("tilt_deg_per_sqrt_m", tilt_deg_per_sqrt_m, at_least(0.0), "Random walk of roll and of pitch.");
    v.field("floor_m", floor_m, greater_than(0.0),
            "Position noise of an increment even when standing still, per axis.");
    v.field("floor_deg", floor_deg, greater_than(0.0), "Rotation noise of an increment even when standing still.");
    v.field("yaw_bias_deg_per_m", yaw_bias_deg_per_m, at_least(0.0), "Slowly varying yaw drift (Gauss-Markov).");
    v.field("bias_length_m", bias_length_m, greater_than(0.0), "Distance over which that bias forgets itself.");
    v.field("yaw_drift_deg_per_m", yaw_drift_deg_per_m, at_least(0.0), "Constant yaw drift of the run.");
    v.field("scale_percent", scale_percent, between(0.0, 50.0), "Constant scale error of the run.");
    v.field("consistent_length_m", consistent_length_m, greater_than(0.0),
            "Length at which the covariance of independent increments matches the constant errors.");
    v.field("slips_per_km", slips_per_km, at_least(0.0), "Failures: sudden errors that the covariance does not know.");
    v.field("slip_m", slip_m, at_least(0.0), "Horizontal size of a slip, per axis.");
    v.field("slip_deg", slip_deg, at_least(0.0), "Yaw of a slip.");
    v.field("start_tilt_deg", start_tilt_deg, between(0.0, 30.0), "Largest tilt of the odom frame.");
    v.field("start_shift_m", start_shift_m, at_least(0.0), "Largest distance of the odom origin, per axis.");
  }
};

struct OdometrySimulation {
  Trajectory odometry;                         ///< T_odom_body at the stamps of the truth, in an odom frame of its own.
  std::vector<Matrix6d> increment_covariance;  ///< Of k -> k + 1, right tangent; one fewer than odometry.
};

/// Measures the increments of a true trajectory with noise. The covariances are meant for independent increments;
/// correlated errors are therefore inflated so that stretches stay honest: a Gauss-Markov bias with standard deviation
/// s per metre and length L turns by a variance of 2 s^2 L per metre in the long run, a constant error c by c^2 times
/// `consistent_length_m` per metre. Shorter stretches are then overestimated, never underestimated.
OdometrySimulation simulate_odometry(const Trajectory& truth, const OdometryNoiseConfig& config, Rng rng);

}  // namespace tutti::simulation
