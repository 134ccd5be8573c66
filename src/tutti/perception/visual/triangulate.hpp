// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <span>
#include <tl/expected.hpp>
#include <vector>

#include "tutti/geometry/camera.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::visual {

struct TriangulationConfig {
  int min_views = 2;                 ///< Least number of views that fit; each camera of a keyframe counts.
  double min_parallax_deg = 1.0;     ///< Least angle between two of the rays that fit.
  double max_reprojection_px = 3.0;  ///< A view with a larger error does not fit.
};

/// A pixel that presumably sees the point.
struct View {
  const CameraModel* camera = nullptr;
  Pose3 T_camera_submap;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
};

struct TriangulatedPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Submap frame, m.
  /// From the pixels' sigmas, m^2; scaled up where the residuals are larger, because poses err, too.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::vector<bool> fits;  ///< Per view whether it is within max_reprojection_px.
};

/// Why views give no point.
enum class TriangulationFault {
  parallax,  ///< All views are from nearly the same direction, so the distance is open.
  behind,    ///< The rays meet behind a camera.
  misfit,    ///< Fewer than min_views views agree on a point.
};

/// The point that the views see: the point nearest to their rays (nearest_point()), improved by Gauss-Newton on the
/// reprojection errors with Cauchy's loss, and once more, without loss, over the views that fit.
tl::expected<TriangulatedPoint, TriangulationFault> triangulate(std::span<const View> views,
                                                                const TriangulationConfig& config);

/// Information (inverse covariance, 1/m^2) that the views have of a point at `position`, submap frame. Views that
/// cannot see the point add nothing.
Eigen::Matrix3d point_information(std::span<const View> views, const Eigen::Vector3d& position);

}  // namespace tutti::visual
