// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/estimation/termination.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/model/visual.hpp"

/// Bundle adjustment: keyframes, landmarks, odometry and IMU in one least-squares problem. Poses T_world_body, tangent
/// [translation; rotation] right (geometry/pose3.hpp).
namespace tutti::bundle {

struct BundleKeyframe {
  KeyframeId id;
  Pose3 T_world_body;
  bool is_constant = false;  ///< The adjustment must not move the pose.
};

/// A camera of a robot.
struct BundleCamera {
  RobotId robot;
  std::uint32_t index = 0;  ///< VisualFrame::camera: the camera's number on its robot.
  Camera camera;
};

/// One view of a landmark; indices into BundleProblem.
struct BundleObservation {
  std::size_t keyframe = 0;
  std::size_t camera = 0;
  std::size_t landmark = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
};

/// Measured T_from_to; indices into BundleProblem::keyframes.
struct BundleOdometry {
  std::size_t from = 0;
  std::size_t to = 0;
  RelativePose measurement;
};

/// The IMU's measurement between two keyframes; indices into BundleProblem::keyframes.
struct BundleImu {
  std::size_t from = 0;
  std::size_t to = 0;
  ImuPreintegration measurement;
};

/// The variables (keyframes, landmarks) and the measurements (observations, odometry, IMU).
struct BundleProblem {
  std::vector<BundleKeyframe> keyframes;
  std::vector<BundleCamera> cameras;
  std::vector<Eigen::Vector3d> landmarks;  ///< World frame, m.
  std::vector<BundleObservation> observations;
  std::vector<BundleOdometry> odometry;
  std::vector<BundleImu> imu;
};

/// Reprojection errors of one camera: how far its pixels are from the projections of their landmarks. A wrong
/// calibration shows here.
struct CameraResiduals {
  RobotId robot;
  std::uint32_t camera = 0;
  std::size_t observations = 0;
  std::size_t unseen = 0;  ///< Observations without an error because their landmark lies behind the camera.
  double median_px = 0.0;  ///< Median length of the errors.
  double ninetieth_percentile_px = 0.0;
};

/// Variables of a keyframe, beside its pose, that IMU factors need.
struct MotionState {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();            ///< World frame, m/s.
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();           ///< Body frame, rad/s.
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< Body frame, m/s^2.
};

struct AdjustmentSummary {
  estimation::Termination termination = estimation::Termination::not_run;
  int iterations = 0;
  /// Connected components of the keyframes; one without constant keyframes has a gauge of its own.
  int components = 0;
  double initial_cost = -1.0;  ///< Sum of rho(r^T Omega r) / 2.
  double final_cost = -1.0;
  std::string message;  ///< From the solver, for logs.
};

struct BundleSolution {
  std::vector<Pose3> T_world_body;  ///< Per keyframe. Constant keyframes have not moved, nor has the first one of a
                                    ///< component without constant keyframes.
  std::vector<Eigen::Vector3d> landmarks;  ///< World frame, m.
  std::vector<MotionState> motion;         ///< Per keyframe; meaningful where an IMU factor ends.
  /// Per component, m/s^2, world frame; zero for a component without IMU factors.
  std::vector<Eigen::Vector3d> gravity;
  std::vector<int> component;  ///< Per keyframe.
  AdjustmentSummary summary;
};

}  // namespace tutti::bundle
