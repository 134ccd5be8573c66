// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <optional>
#include <vector>

#include "tutti/model/trajectory.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::visual {

/// Epipolar error of two unit rays to a point, each in its camera's frame, rad: the smaller of the two angles between a
/// ray and the plane of the other ray and the baseline. 0 without a baseline.
double epipolar_error_rad(const Pose3& T_first_second, const Eigen::Vector3d& ray_first,
                          const Eigen::Vector3d& ray_second);

/// Tests whether a camera's images are stamped by the odometry's clock, and whether the camera is mounted with the
/// stated roll. Where the clocks differ, points that are followed from image to image leave the epipolar planes that
/// the odometry's poses give them, most where the robot starts to turn.
class ClockCheck {
 public:
  static constexpr double kPair_s = 0.4;      ///< Least time between the images of a pair.
  static constexpr std::size_t kPairs = 60;   ///< Pairs that are enough; further images are ignored.
  static constexpr double kLargest_s = 0.5;   ///< Offsets are searched up to this one, in either direction,
  static constexpr double kStep_s = 0.02;     ///< in these steps.
  static constexpr double kConvincing = 0.6;  ///< An answer must reduce the mean error to this share.

  explicit ClockCheck(Camera camera) : camera_(std::move(camera)) {}
  /// Adds an image with its tracks, by increasing stamps.
  void add(Timestamp stamp, const TrackedImage& image);
  [[nodiscard]] std::size_t pairs() const { return pairs_.size(); }
  /// The offset to add to the images' stamps, s, where this makes them fit the odometry far better; no value where they
  /// fit as they are or do not determine it.
  [[nodiscard]] std::optional<double> offset_s(const Trajectory& odometry) const;
  /// By how much the camera seems to be turned about its optical axis against Camera::T_body_camera, 90, 180 or 270
  /// degrees, where this fits the odometry far better; no value where the camera fits as stated or the motion does not
  /// determine it, as straight ahead along the axis.
  [[nodiscard]] std::optional<int> roll_deg(const Trajectory& odometry) const;

 private:
  struct Pair {
    Timestamp first, second;
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rays;  ///< Unit, camera frame.
  };
  /// Mean error with the stamps later by `offset_s` and the camera turned by `roll_rad` about its axis; no value when
  /// fewer than half of the pairs lie within the odometry.
  [[nodiscard]] std::optional<double> error_rad(const Trajectory& odometry, double offset_s, double roll_rad) const;

  Camera camera_;
  Timestamp last_;
  std::map<std::uint64_t, Eigen::Vector3d> seen_;  ///< Rays of the image at last_, by track.
  std::vector<Pair> pairs_;
};

}  // namespace tutti::visual
