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
  int min_views = 2;                 ///< That fit; the cameras of one keyframe count each.
  double min_parallax_deg = 1.0;     ///< Between two of the rays that fit.
  double max_reprojection_px = 3.0;  ///< A view farther off does not fit.
};

/// A pixel that is thought to see the point.
struct View {
  const CameraModel* camera = nullptr;
  Pose3 T_camera_submap;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 1.0;
};

struct TriangulatedPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< Submap frame, m.
  /// From the pixels' sigmas, enlarged where the residuals are larger than those: poses err, too.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  std::vector<bool> fits;  ///< Of every view: is it within max_reprojection_px?
};

enum class TriangulationFault {
  parallax,  ///< Seen from nearly the same direction by all: nobody can say how far it is.
  behind,    ///< The rays meet behind a camera.
  misfit,    ///< Fewer than min_views agree on a point.
};

/// The point that the views see: the midpoint of their rays (the least sum of squared distances to them), then
/// Gauss-Newton on the reprojection errors with Cauchy's loss, and once more over those that fit without it.
tl::expected<TriangulatedPoint, TriangulationFault> triangulate(std::span<const View> views,
                                                                const TriangulationConfig& config);

/// Information (inverse covariance, 1/m^2) that pixels of these standard deviations have of a point, submap frame.
/// Views that cannot see it add nothing.
Eigen::Matrix3d point_information(std::span<const View> views, const Eigen::Vector3d& position);

}  // namespace tutti::visual
