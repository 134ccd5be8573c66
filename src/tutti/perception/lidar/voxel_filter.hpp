// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <memory>
#include <span>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"

namespace tutti::lidar {

/// A cloud in the body frame and where that body stood in the submap.
struct PosedCloud {
  Timestamp stamp;
  Pose3 T_submap_body;
  std::shared_ptr<const PointCloud> cloud;  ///< Body frame; null counts as empty.
};

/// Distances from the body's origin between which points are kept.
struct RangeLimits {
  double min_m = 0.0;
  double max_m = std::numeric_limits<double>::infinity();
};

/// Centroid of the points in every cubic voxel of side `voxel_m` (> 0) of a grid through the origin, in Morton order of
/// the voxels. The result, to the bit, does not depend on the order of the input. Points that are not finite, or more
/// than 2^20 voxels away from the origin along an axis, are skipped; first_skipped() returns beforehand whether there
/// are any.
PointCloud voxel_downsample(const PointCloud& cloud, double voxel_m);

/// The first point that voxel_downsample() skips; null when it keeps all.
const Eigen::Vector3f* first_skipped(const PointCloud& cloud, double voxel_m);

/// All clouds together in the submap frame, as voxel_downsample() thins them; points outside `limits` are skipped.
PointCloud merge_scans(std::span<const PosedCloud> scans, double voxel_m, RangeLimits limits = {});

}  // namespace tutti::lidar
