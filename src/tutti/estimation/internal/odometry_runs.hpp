// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "tutti/model/relative_pose.hpp"

namespace tutti::estimation::internal {

/// The odometry between two neighbouring nodes of the reduced graph, compounded into one factor (right tangent at end).
struct OdometryRun {
  std::size_t begin = 0;
  std::size_t end = 0;
  Pose3 T_begin_end;
  Matrix6d information = Matrix6d::Zero();
  double length_m = 0.0;  ///< Of the path.
  /// local(T_begin_end, ...) of the ends for which the inner poses were last bent; none = they are not of this run.
  std::optional<Vector6d> bent;
};

/// All runs between consecutive nodes of the reduced graph, and nothing else: a run is compounded when it appears and
/// forgotten when one of its ends is no longer a node.
class OdometryRuns {
 public:
  /// `nodes` increasing. Returns how many odometry steps were compounded, that is, were not in a run that stayed.
  std::size_t update(std::span<const std::size_t> nodes, std::span<const RelativePose> odometry);

  /// Sets the nodes' poses (T_map_node) and makes the inner poses follow. A run whose ends kept their relative pose
  /// within a micrometre over its length since it was bent is moved rigidly. Returns how many poses were bent.
  std::size_t place(std::span<const Pose3> nodes, std::span<const RelativePose> odometry, std::span<Pose3> poses);

  /// Somebody else changed inner poses: bend every run next time.
  void forget_bends();

  [[nodiscard]] const std::vector<OdometryRun>& all() const { return runs_; }

 private:
  std::vector<OdometryRun> runs_;
};

}  // namespace tutti::estimation::internal
