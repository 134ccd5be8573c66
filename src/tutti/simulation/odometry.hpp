// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/base/rows.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/model/trajectory.hpp"
#include "tutti/simulation/bounds.hpp"
#include "tutti/simulation/corridor_world.hpp"

namespace tutti::simulation {

/// Errors along featureless corridors, where nothing tells the position along the axis. The robot notices: its
/// covariance is inflated along the axis.
struct DegeneracyConfig {
  double slide_percent = 3.0;        ///< Error of the speed along the axis, drawn anew at every visit.
  double least_slide_percent = 0.0;  ///< A smaller slide becomes this large, with its sign.
  double along_m_per_sqrt_m = 0.05;  ///< Random walk along the axis.
};

/// A localisation failure under the open sky, once per run, which the covariance does not show.
struct FailureConfig {
  double after_m = 5.0;    ///< Begins after this distance in the open,
  double length_m = 20.0;  ///< and lasts this long, or until the robot is back inside.
  double yaw_deg = 0.0;    ///< Yaw error it ends with, to either side.
  double drift_m = 0.0;    ///< Position error it ends with, in one drawn horizontal direction.
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

/// Errors of an odometry that knows gravity: yaw drifts more than tilt. All are standard deviations; the constants of
/// one run (scale, yaw drift) are drawn once from them. The robot's covariance shows neither slips nor failures.
struct OdometryNoiseConfig {
  double translation_m_per_sqrt_m = 0.01;  ///< Random walk of position, per axis.
  double yaw_deg_per_sqrt_m = 0.05;        ///< Random walk of yaw.
  double tilt_deg_per_sqrt_m = 0.01;       ///< Random walk of roll and of pitch.
  double floor_m = 1e-4;                   ///< Position noise of an increment even when standing still, per axis.
  double floor_deg = 1e-3;                 ///< Rotation noise of an increment even when standing still.
  double yaw_bias_deg_per_m = 0.003;       ///< Slowly varying yaw drift (Gauss-Markov).
  double yaw_drift_deg_per_m = 0.0;        ///< Constant yaw drift of the run.
  double scale_percent = 0.2;              ///< Constant scale error of the run.
  /// Length at which the covariance of independent increments matches the constant errors.
  double consistent_length_m = 50.0;
  /// Stated standard deviations over the honest ones: above 1 the odometry is better than it says.
  double stated_sigma_factor = 1.0;
  double slips_per_km = 0.0;  ///< Sudden errors.
  double slip_m = 0.1;        ///< Horizontal size of a slip, per axis.
  double slip_deg = 0.2;      ///< Yaw of a slip.
  DegeneracyConfig degeneracy;
  FailureConfig failure;
  std::vector<ScriptedErrorConfig> scripted;
};

/// An odometry that can be chosen.
struct OdometryKind {
  std::string_view name, help;
  OdometryNoiseConfig config;
};
const std::vector<OdometryKind>& odometry_kinds();

/// The errors of a simulated robot's odometry: those of a kind, and what is given beside it instead.
struct OdometryChoice {
  std::string kind = "honest";
  std::optional<double> translation_m_per_sqrt_m, yaw_deg_per_sqrt_m, yaw_bias_deg_per_m, scale_percent, slips_per_km,
      slip_deg, slide_percent;
  std::vector<ScriptedErrorConfig> scripted;
  template <class V>
  void describe(V& v) {
    v.field("kind", kind, one_of(names_of(odometry_kinds())),
            help_of(odometry_kinds()) + ". What follows counts instead of the kind's own.");
    v.field("translation_m_per_sqrt_m", translation_m_per_sqrt_m, between(0.0, kFarthest_m),
            "Random walk of position, per axis.");
    v.field("yaw_deg_per_sqrt_m", yaw_deg_per_sqrt_m, between(0.0, 180.0), "Random walk of yaw.");
    v.field("yaw_bias_deg_per_m", yaw_bias_deg_per_m, between(0.0, 180.0), "Slowly varying yaw drift (Gauss-Markov).");
    v.field("scale_percent", scale_percent, between(0.0, 50.0), "Constant scale error of the run.");
    v.field("slips_per_km", slips_per_km, between(0.0, 1e6), "Sudden errors that the covariance does not know.");
    v.field("slip_deg", slip_deg, between(0.0, 180.0), "Yaw of a slip.");
    v.field("slide_percent", slide_percent, between(0.0, 50.0),
            "Error of the speed along featureless corridors, drawn anew at every visit.");
    v.field("scripted", scripted, any(), "Errors of given size at given places.");
  }
  [[nodiscard]] OdometryNoiseConfig config() const;
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
