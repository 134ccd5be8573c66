// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/model/point_cloud.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::localise {

/// Tells when a robot is shut in, as in a lift: it stands, and for kFor_s its scans have shown nothing farther than
/// kReach_m. It is not any more as soon as a scan shows more.
class ShutIn {
 public:
  static constexpr double kFor_s = 3.0;
  static constexpr double kReach_m = 4.0;      ///< Lifts for beds and goods are about 3 m long.
  static constexpr double kMostBeyond = 0.02;  ///< Share of a scan's points: stray ones, and a gap of the door.
  static constexpr double kStands_m = 0.5;

  /// A scan, and where odometry had the robot then. Points nearer than `min_range_m` are on the robot itself; a scan
  /// without others changes nothing.
  void see(const PointCloud& cloud, double min_range_m, const StampedPose& T_odom_body);
  [[nodiscard]] bool is() const { return is_; }

 private:
  std::optional<StampedPose> since_;  // by odometry
  bool is_ = false;
};

}  // namespace tutti::localise
