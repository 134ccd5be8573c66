// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/perception/lidar/oriented_cloud.hpp"

namespace tutti::lidar {

/// How far one could see from a viewpoint: distance to the nearest surface by direction, on a grid of 128 x 64.
class DepthPanorama {
 public:
  /// `spacing_m`: distance of neighbouring points, between which a surface is taken as closed. Viewpoint in the cloud's
  /// frame.
  DepthPanorama(const OrientedCloud& cloud, const Eigen::Vector3f& viewpoint, float spacing_m);
  /// Distance, m, at which the view towards `point` ends; 0 where nothing was seen in that direction.
  [[nodiscard]] float depth_towards(const Eigen::Vector3f& point) const;
  [[nodiscard]] const Eigen::Vector3f& viewpoint() const { return viewpoint_; }
  [[nodiscard]] std::size_t bytes() const {  ///< Memory used.
    return sizeof *this + depth_cm_.capacity() * sizeof(std::uint16_t);
  }

 private:
  Eigen::Vector3f viewpoint_;
  std::vector<std::uint16_t> depth_cm_;  // rows of equal elevation; 0 = nothing seen
};

/// Points of one submap against what the viewpoints of another one saw; a point counts once per viewpoint.
struct VisibilityCount {
  int seen = 0;           ///< Points on the surface that was seen.
  int contradicting = 0;  ///< Points in front of it, where the other submap looked through.
};

/// Counts for an even sample of at most `max_points` points of `source` and all views of the target. A point within
/// `margin_m` of the surface is on it.
VisibilityCount count_visible(const std::vector<DepthPanorama>& target_views, const OrientedCloud& source,
                              const Pose3& T_target_source, int max_points, float margin_m);

}  // namespace tutti::lidar
