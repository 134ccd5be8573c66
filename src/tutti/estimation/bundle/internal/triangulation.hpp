// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "tutti/estimation/bundle/bundle_problem.hpp"

namespace tutti::bundle::internal {

/// The point of the world that the views' rays meet in, least squares of the reprojection errors where an error above
/// `max_px` counts as `max_px`: the best of `starts` and of the rays' common midpoint, refined by Gauss-Newton.
std::optional<Eigen::Vector3d> triangulate(const BundleProblem& problem, std::span<const BundleObservation> views,
                                           std::span<const Eigen::Vector3d> starts, double max_px);

/// Largest angle between two of the views' rays at the point, rad.
double parallax(const BundleProblem& problem, std::span<const BundleObservation> views, const Eigen::Vector3d& point);

/// Length of the reprojection error, px; infinity when the camera does not see the point.
double error_px(const BundleProblem& problem, const BundleObservation& view, const Eigen::Vector3d& point);

}  // namespace tutti::bundle::internal
