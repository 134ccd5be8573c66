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

/// How far two unit rays to a point are from lying in one plane with the two cameras, rad: the smaller of the angles
/// between a ray and the plane of the other one and the baseline. Without a baseline there is no such plane: 0.
double epipolar_error_rad(const Pose3& T_first_second, const Eigen::Vector3d& ray_first,
                          const Eigen::Vector3d& ray_second);

/// Are a camera's images stamped by the clock of the odometry? Where the two are apart, points that are followed from
/// image to image leave the planes that the odometry's poses put them in, most where the robot starts to turn.
class ClockCheck {
 public:
  static constexpr double kPair_s = 0.4;      ///< At least between the images of a pair.
  static constexpr std::size_t kPairs = 60;   ///< Enough to ask.
  static constexpr double kLargest_s = 0.5;   ///< Offsets are looked for up to here, either way,
  static constexpr double kStep_s = 0.02;     ///< in these steps.
  static constexpr double kConvincing = 0.6;  ///< Its error is at most this share of that without an offset.

  explicit ClockCheck(Camera camera) : camera_(std::move(camera)) {}
  /// An image with its tracks; by increasing stamps.
  void add(Timestamp stamp, const TrackedImage& image);
  [[nodiscard]] std::size_t pairs() const { return pairs_.size(); }
  /// What to add to the images' stamps, s, where that makes them fit the odometry far better than they do; nothing
  /// where they fit, or cannot tell.
  [[nodiscard]] std::optional<double> offset_s(const Trajectory& odometry) const;
  /// By how much the camera seems to be turned about its optical axis against Camera::T_body_camera, 90, 180 or 270
  /// degrees, where that fits the odometry far better than none; nothing where it fits, or cannot tell: straight ahead
  /// along the axis all turns are alike.
  [[nodiscard]] std::optional<int> roll_deg(const Trajectory& odometry) const;

 private:
  struct Pair {
    Timestamp first, second;
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> rays;  ///< Unit, camera frame.
  };
  /// Mean error with the stamps so much later and the camera so turned about its axis; nothing when hardly a pair lies
  /// within the odometry.
  [[nodiscard]] std::optional<double> error_rad(const Trajectory& odometry, double offset_s, double roll_rad) const;

  Camera camera_;
  Timestamp last_;
  std::map<std::uint64_t, Eigen::Vector3d> seen_;  ///< Rays of that image by track.
  std::vector<Pair> pairs_;
};

}  // namespace tutti::visual
