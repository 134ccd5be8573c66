// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/model/visual.hpp"

namespace tutti::visual {

/// By how much the second of two cameras is turned against what its calibration says.
struct StereoTurn {
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();  ///< R_first_second = R_told Exp(turn_rad): of the second's axes.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< rad^2, by the points, and kTold_rad of any calibration.
  double told_px = 0.0, turned_px = 0.0;  ///< Median distance from the epipolar lines, as told and turned.
  bool is_wrong = false;                  ///< More than kMaxSigmas of it, or kMax_px left when turned.
  bool is_turned = false;                 ///< ... and the turn explains most of it.
};

/// Points that two cameras see at one moment lie in one plane with both. Where the cameras are turned against each
/// other they leave it, each at its place in the images, whatever the robot does and however far the points are:
/// neither odometry nor landmarks are asked. A turn about the images' upright axis, which is what bends depths, shows
/// towards the corners only.
class StereoCheck {
 public:
  static constexpr std::size_t kFew = 200;     ///< Points: fewer tell nothing.
  static constexpr double kTold_rad = 0.0009;  ///< 0.05 degrees: EuRoC's cameras are 0.025 off, of all causes.
  static constexpr double kMaxSigmas = 4.0;
  static constexpr double kMax_px = 1.0;  ///< Median: EuRoC's 0.07, simulated ones 0.2.
  StereoCheck(Camera first, Camera second) : first_(std::move(first)), second_(std::move(second)) {}
  /// Keypoints of one moment; the same track is the same point.
  void add(const TrackedImage& first, const TrackedImage& second);
  /// Nothing of few points, and without a baseline.
  [[nodiscard]] std::optional<StereoTurn> turn() const;

 private:
  Camera first_, second_;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rays_;  ///< Unit, each in its camera's frame.
};

}  // namespace tutti::visual
