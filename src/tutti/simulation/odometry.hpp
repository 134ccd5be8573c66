// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/simulation/bounds.hpp"
#include "tutti/simulation/corridor_world.hpp"

namespace tutti::simulation {

/// Errors along featureless corridors, where nothing tells the position along the axis. The robot notices: its
/// covariance is inflated along the axis.
struct DegeneracyConfig {
  double slide_percent = 3.0;
  double least_slide_percent = 0.0;
  double along_m_per_sqrt_m = 0.05;
  template <class V>
  void describe(V& v) {
    v.field("slide_percent", slide_percent, between(0.0, 50.0),
            "Error of the speed along the axis, drawn anew at every visit.");
    v.field("least_slide_percent", least_slide_percent, between(0.0, 50.0),
            "What is drawn smaller becomes this large, with its sign.");
    v.field("along_m_per_sqrt_m", along_m_per_sqrt_m, between(0.0, kFarthest_m), "Random walk along the axis.");
  }
};

/// A localisation failure under the open sky, once per run, which the covariance does not show.
struct FailureConfig {
  double after_m = 5.0;
  double length_m = 20.0;
  double yaw_deg = 0.0;
  double drift_m = 0.0;
  template <class V>
  void describe(V& v) {
    v.field("after_m", after_m, between(0.0, kFarthest_m), "Begins after this distance in the open.");
    v.field("length_m", length_m, above_zero_to(kFarthest_m), "Lasts this long, or until the robot is back inside.");
    v.field("yaw_deg", yaw_deg, between(0.0, 180.0), "Yaw error it ends with, to either side.");
    v.field("drift_m", drift_m, between(0.0, kFarthest_m),
            "Position error it ends with, in one drawn horizontal direction.");
  }
};

/// One error at a given place of the run, which the covariance does not show: odometry reports this move and turn in
/// addition to the true ones. It is given in the robot's level frame, and happens at once or evenly over a length of
/// way. If the place is never reached, it does not happen.
struct ScriptedErrorConfig {
  double after_m = 0.0;
  bool at_start = false;
  double length_m = 0.0;
  double yaw_deg = 0.0;
  double ahead_m = 0.0;
  double left_m = 0.0;
  double up_m = 0.0;
  template <class V>
  void describe(V& v) {
    v.field("after_m", after_m, between(0.0, kFarthest_m), "After this distance of the run.");
    v.field("at_start", at_start, any(), "... waits until the robot next passes where it started.");
    v.field("length_m", length_m, between(0.0, kFarthest_m), "Way over which the error grows; 0 = all at once.");
    v.field("yaw_deg", yaw_deg, between(-180.0, 180.0), "Size it ends with: a turn to the left");
    v.field("ahead_m", ahead_m, between(-kFarthest_m, kFarthest_m), "... and a move ahead,");
    v.field("left_m", left_m, between(-kFarthest_m, kFarthest_m), "... to the left,");
    v.field("up_m", up_m, between(-kFarthest_m, kFarthest_m), "... up.");
  }
};

/// Drift of an odometry that knows gravity: yaw drifts more than tilt. All are standard deviations; the constants of
/// one run (scale, yaw drift) are drawn once from them.
struct OdometryDriftConfig {
  double translation_m_per_sqrt_m = 0.01;
  double yaw_deg_per_sqrt_m = 0.05;
  double tilt_deg_per_sqrt_m = 0.01;
  double floor_m = 1e-4;
  double floor_deg = 1e-3;
  double yaw_bias_deg_per_m = 0.003;
  double yaw_drift_deg_per_m = 0.0;
  double scale_percent = 0.2;
  double consistent_length_m = 50.0;
  double stated_sigma_factor = 1.0;
  template <class V>
  void describe(V& v) {
    v.field("translation_m_per_sqrt_m", translation_m_per_sqrt_m, between(0.0, kFarthest_m),
            "Random walk of position, per axis.");
    v.field("yaw_deg_per_sqrt_m", yaw_deg_per_sqrt_m, between(0.0, 180.0), "Random walk of yaw.");
    v.field("tilt_deg_per_sqrt_m", tilt_deg_per_sqrt_m, between(0.0, 180.0), "Random walk of roll and of pitch.");
    v.field("floor_m", floor_m, above_zero_to(kFarthest_m),
            "Position noise of an increment even when standing still, per axis.");
    v.field("floor_deg", floor_deg, above_zero_to(180.0), "Rotation noise of an increment even when standing still.");
    v.field("yaw_bias_deg_per_m", yaw_bias_deg_per_m, between(0.0, 180.0), "Slowly varying yaw drift (Gauss-Markov).");
    v.field("yaw_drift_deg_per_m", yaw_drift_deg_per_m, between(0.0, 180.0), "Constant yaw drift of the run.");
    v.field("scale_percent", scale_percent, between(0.0, 50.0), "Constant scale error of the run.");
    v.field("consistent_length_m", consistent_length_m, above_zero_to(kFarthest_m),
            "Length at which the covariance of independent increments matches the constant errors.");
    v.field("stated_sigma_factor", stated_sigma_factor, above_zero_to(1e6),
            "Stated standard deviations over the honest ones: above 1 the odometry is better than it says.");
  }
};

/// Drift, and what a robot's covariance does not show or shows along one axis alone.
struct OdometryNoiseConfig : OdometryDriftConfig {
  double slips_per_km = 0.0;
  double slip_m = 1.0;
  double slip_deg = 10.0;
  DegeneracyConfig degeneracy;
  FailureConfig failure;
  std::vector<ScriptedErrorConfig> scripted;
  template <class V>
  void describe(V& v) {
    OdometryDriftConfig::describe(v);
    v.field("slips_per_km", slips_per_km, between(0.0, 1e6), "Sudden errors that the covariance does not know.");
    v.field("slip_m", slip_m, between(0.0, kFarthest_m), "Horizontal size of a slip, per axis.");
    v.field("slip_deg", slip_deg, between(0.0, 180.0), "Yaw of a slip.");
    v.field("degeneracy", degeneracy, any(), "Along featureless corridors.");
    v.field("failure", failure, any(), "In the open.");
    v.field("scripted", scripted, any(), "Errors of given size at given places.");
  }
};

/// The corridor a robot is in at one sample.
struct Surroundings {
  CorridorKind kind = CorridorKind::rough;
  std::size_t corridor = 0;
  /// Direction of the corridor: unit vector in the frame `reference`.
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
};

/// The nearest corridor of each sample.
std::vector<Surroundings> surroundings_along(const CorridorWorld& world, const Trajectory& truth);

/// Simulated odometry with the errors that were put into it.
struct OdometrySimulation {
  Trajectory odometry;                         ///< T_odom_body at the stamps of the truth, in its own odom frame.
  std::vector<Matrix6d> increment_covariance;  ///< The step's k -> k + 1, right tangent; one fewer than odometry.
  std::vector<DriftOrigin> drift_origins;      ///< Slips, featureless corridors and failures, in time order.
};

/// Odometry of a true trajectory: its steps, measured with noise. `surroundings` has one entry per pose, or is empty:
/// rough everywhere.
///
/// Covariances are stated as if steps were independent, so correlated errors are inflated until long segments are
/// stated correctly. A Gauss-Markov bias with standard deviation s per metre and length L adds a variance of 2 s^2 L
/// per metre; a constant error c adds c^2 times `consistent_length_m` per metre; the slide along a featureless corridor
/// adds its square times the length of the visit. Shorter segments are thereby overestimated, never underestimated.
OdometrySimulation simulate_odometry(const Trajectory& truth, std::span<const Surroundings> surroundings,
                                     const OdometryNoiseConfig& config, Rng rng);

}  // namespace tutti::simulation
