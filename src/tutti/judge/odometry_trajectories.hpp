// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "tutti/geometry/segment_covariance.hpp"
#include "tutti/model/pose_graph.hpp"
#include "tutti/model/relative_pose.hpp"

namespace tutti::judge {

/// The odometry of a pose graph, for relative poses between any two of its nodes. Odometry consists of segments without
/// a gap, each a chain of edges that lead from a node to a later one.
class OdometryTrajectories {
 public:
  /// `seconds`: time of each node, from any origin. `odometry`: at most one edge begins and one ends at a node, and
  /// from < to.
  OdometryTrajectories(std::span<const double> seconds, std::span<const PoseGraphEdge> odometry);

  /// The first node of this one's segment.
  [[nodiscard]] std::size_t segment(std::size_t node) const { return at_[node].segment; }
  [[nodiscard]] double seconds(std::size_t node) const { return at_[node].seconds; }
  /// Median speed of all steps, m/s, above 0, which occasional failures hardly change.
  [[nodiscard]] double usual_speed() const { return usual_speed_; }
  /// How far a body goes between two nodes of one segment at the usual speed, m. Steps in which odometry flies, three
  /// times as fast as what is usual most of the time, count at the length that it states: it may have missed all of it.
  [[nodiscard]] double reach_m(std::size_t a, std::size_t b) const { return std::abs(at_[a].reach_m - at_[b].reach_m); }
  /// T_first_node, `first` being the first node of its segment.
  [[nodiscard]] const Pose3& pose(std::size_t node) const { return at_[node].pose; }
  /// T_a_b of two nodes of one segment, either first.
  [[nodiscard]] Pose3 T(std::size_t a, std::size_t b) const { return pose(a).inverse() * pose(b); }
  /// T_a_b with its covariance.
  [[nodiscard]] RelativePose between(std::size_t a, std::size_t b) const;
  /// Trace of the rotation's covariance between two nodes of one segment.
  [[nodiscard]] double turn_variance(std::size_t a, std::size_t b) const;

 private:
  struct At {
    std::size_t segment = 0;
    std::size_t position = 0;  ///< Along the segment.
    double seconds = 0.0;
    double turn_variance = 0.0;  ///< Since the segment began, as what follows.
    double reach_m = 0.0;
    Pose3 pose;
  };
  std::vector<At> at_;
  std::vector<SegmentCovariance> covariance_;  // per segment, by its first node
  double usual_speed_ = 0.0;
};

}  // namespace tutti::judge
