// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/perception/lidar/oriented_cloud.hpp"

namespace tutti::lidar {

/// How far one could see from a viewpoint: distance to the nearest surface by direction.
class DepthPanorama {
 public:
  /// `spacing_m`: distance of neighbouring points; nearer surfaces are closed up to this.
  DepthPanorama(const OrientedCloud& cloud, const Eigen::Vector3f& viewpoint, float spacing_m);
  /// Distance at which the view towards `point` ends; 0 where nothing was seen in that direction.
  [[nodiscard]] float depth_towards(const Eigen::Vector3f& point) const;
  [[nodiscard]] const Eigen::Vector3f& viewpoint() const { return viewpoint_; }
  [[nodiscard]] std::size_t bytes() const {  ///< Of memory held.
    return sizeof *this + depth_cm_.capacity() * sizeof(std::uint16_t);
  }

 private:
  Eigen::Vector3f viewpoint_;
  std::vector<std::uint16_t> depth_cm_;  // rows of equal elevation; 0 = nothing seen
};

/// Points of one submap against what another submap's viewpoints saw.
struct VisibilityCount {
  int seen = 0;           ///< On the surface that was seen.
  int contradicting = 0;  ///< In front of it, where one looked through.
};

/// Counts over an even sample of at most `max_points` oriented points of `source` and all views of the target.
VisibilityCount count_visible(const std::vector<DepthPanorama>& target_views, const OrientedCloud& source,
                              const Pose3& T_target_source, int max_points, float margin_m);

}  // namespace tutti::lidar
