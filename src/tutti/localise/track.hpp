// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/localise/known_map.hpp"
#include "tutti/localise/place_search.hpp"
#include "tutti/localise/scan_match.hpp"
#include "tutti/model/input.hpp"
#include "tutti/model/relative_pose.hpp"
#include "tutti/model/trajectory.hpp"

namespace tutti::localise {

/// The raw odometry of the last seconds: of the longest sweep, and of scans that wait for it.
class RecentOdometry {
 public:
  static constexpr double kKept_s = 3.0;
  void add(const OdometrySample& sample);
  [[nodiscard]] const Trajectory& poses() const { return poses_; }
  /// The newest sample, with a bounded covariance; nothing before the first.
  [[nodiscard]] std::optional<OdometrySample> newest() const;
  /// The sum of what the steps after `from`, to `to`, are stated to err by.
  [[nodiscard]] Matrix6d stated(Timestamp from, Timestamp to) const;

 private:
  Trajectory poses_;
  std::vector<Matrix6d> steps_;  // covariance of the step to each
};

/// The pose in the map of a robot that is followed there: a Kalman filter, which odometry moves and poses correct.
struct Track {
  std::uint32_t floor = 1;                 ///< In whose frame the pose is.
  RelativePose T_world_body;               ///< At `at`; right tangent, without what the map itself errs by.
  StampedPose at;                          ///< By odometry.
  Timestamp confirmed;                     ///< When a scan last lay on the map.
  int to_confirm = 0;                      ///< Scans that are still to confirm it before it counts.
  GuessGate gate = GuessGate::of_found();  ///< That they must pass.
  std::optional<double> overlap;           ///< ScanMatch::overlap of that scan.
  std::optional<double> usual_quality;     ///< ScanMatch::quality() of scans that confirmed it, by learn().
  std::optional<Timestamp> against_since;
  std::optional<StampedPose> doubted_since;  ///< By odometry; no scan has confirmed it from then on.
  std::size_t against = 0;                   ///< Scans in a row.

  /// Moves the pose with odometry to a time after it. `stated`: RecentOdometry::stated() of the way there; odometry may
  /// err by a share of the way, whatever it states.
  void predict_to(const StampedPose& to, const Matrix6d& stated);
  /// The filter's update with a pose of the same time, in Joseph's form.
  void correct(const RelativePose& measured);
  /// Takes the quality of a scan that confirms the pose into what is usual.
  void learn(double quality);
  /// Where odometry has it, at a later time.
  [[nodiscard]] RelativePose carried_to(const Pose3& T_odom_body) const;
  [[nodiscard]] OnFloor position() const { return {floor, T_world_body.T_a_b.translation}; }
};

/// The pose at T_odom_body of a robot that was found at another time.
RelativePose carried_to(const Pose3& T_odom_body, const Hypothesis& place);

}  // namespace tutti::localise
