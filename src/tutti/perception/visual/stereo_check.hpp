// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "tutti/model/visual.hpp"

namespace tutti::visual {

/// By how much the second of two cameras is turned against its calibration.
struct StereoTurn {
  /// R_first_second = R_stated Exp(turn_rad), about the second camera's axes.
  Eigen::Vector3d turn_rad = Eigen::Vector3d::Zero();
  /// rad^2; from the points, plus kStated_rad for any calibration.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  /// Median distance from the epipolar lines, with the calibration as given and turned.
  double stated_px = 0.0, turned_px = 0.0;
  bool is_wrong = false;   ///< The turn exceeds kMaxSigmas, or more than kMax_px is left when turned.
  bool is_turned = false;  ///< Wrong, and the turn explains more than half of the distance.
};

/// Finds out whether two cameras are turned against each other, by the epipolar constraint of points that both see at
/// one time. A turn moves points off their epipolar planes by amounts that depend on their place in the images, not on
/// the robot's motion or the points' distance, so neither odometry nor landmarks are needed. A turn about the images'
/// upright axis, which falsifies depths, shows towards the corners only.
class StereoCheck {
 public:
  static constexpr std::size_t kFew = 200;  ///< Fewer points determine nothing.
  /// Standard deviation of any calibration: 0.05 degrees (EuRoC's cameras are 0.025 off).
  static constexpr double kStated_rad = 0.0009;
  static constexpr double kMaxSigmas = 4.0;
  static constexpr double kMax_px = 1.0;  ///< The median distance's limit (EuRoC 0.07, simulated cameras 0.2).
  StereoCheck(Camera first, Camera second) : first_(std::move(first)), second_(std::move(second)) {}
  /// Adds the keypoints of one time; keypoints of one track are views of one point.
  void add(const TrackedImage& first, const TrackedImage& second);
  /// No value with fewer than kFew points, or without a baseline.
  [[nodiscard]] std::optional<StereoTurn> turn() const;

 private:
  Camera first_, second_;
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rays_;  ///< Unit, each in its camera's frame.
};

}  // namespace tutti::visual
