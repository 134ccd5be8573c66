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
  bool is_constant = false;  ///< Keeps its pose.
};

/// A camera of a robot.
struct BundleCamera {
  RobotId robot;
  std::uint32_t index = 0;  ///< Its number on the robot, VisualFrame::camera.
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

/// What the IMU measured between two keyframes; indices into BundleProblem::keyframes.
struct BundleImu {
  std::size_t from = 0;
  std::size_t to = 0;
  ImuPreintegration measurement;
};

struct BundleProblem {
  std::vector<BundleKeyframe> keyframes;
  std::vector<BundleCamera> cameras;
  std::vector<Eigen::Vector3d> landmarks;  ///< World frame, m.
  std::vector<BundleObservation> observations;
  std::vector<BundleOdometry> odometry;
  std::vector<BundleImu> imu;
};

/// How far a camera's pixels are from where its landmarks project to. A wrong calibration shows here.
struct CameraResiduals {
  RobotId robot;
  std::uint32_t camera = 0;
  std::size_t observations = 0;
  std::size_t unseen = 0;  ///< Of them, how many no pixel sees: the landmark lies behind the camera.
  double median_px = 0.0;  ///< Length of the residual.
  double ninetieth_percentile_px = 0.0;
};

/// What an IMU factor estimates beside the pose of a keyframe.
struct MotionState {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();            ///< World frame, m/s.
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();           ///< Body frame, rad/s.
  Eigen::Vector3d accelerometer_bias = Eigen::Vector3d::Zero();  ///< Body frame, m/s^2.
};

struct AdjustmentSummary {
  estimation::Termination termination = estimation::Termination::not_run;
  int iterations = 0;
  int components = 0;          ///< Sets of keyframes that nothing ties to each other; without constant ones each
                               ///< has a gauge of its own.
  double initial_cost = -1.0;  ///< Sum of rho(r^T Omega r) / 2.
  double final_cost = -1.0;
  std::string message;  ///< The solver's own words.
};

struct BundleSolution {
  std::vector<Pose3> T_world_body;  ///< Per keyframe. Constant ones have not moved, nor the first one of a component
                                    ///< without any.
  std::vector<Eigen::Vector3d> landmarks;  ///< World frame, m.
  std::vector<MotionState> motion;         ///< Per keyframe; meaningful where an IMU factor ends.
  std::vector<Eigen::Vector3d> gravity;    ///< Per component, m/s^2, world frame; zero where there is no IMU factor.
  std::vector<int> component;              ///< Per keyframe.
  AdjustmentSummary summary;
};

}  // namespace tutti::bundle
