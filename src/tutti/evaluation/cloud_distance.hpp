// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "tutti/geometry/pose3.hpp"
#include "tutti/model/point_cloud.hpp"

namespace tutti::evaluation {

/// Cloud-to-cloud distance: how far the points of one cloud are from the surface that another describes. Every point
/// counts the same: thin clouds to equal voxels first, or places seen often count more.
struct CloudDistance {
  std::size_t points = 0;
  double mean_m = 0.0;
  double rms_m = 0.0;
  double p95_m = 0.0;        ///< 95 % of the points are at most this far.
  double within_10cm = 0.0;  ///< Shares of the points, 0 to 1.
  double within_30cm = 0.0;
  double within_1m = 0.0;
};

/// Over the distances that are finite; nothing when none is.
std::optional<CloudDistance> summarise(std::span<const float> distances_m);

/// A cloud that distances are measured to. Distances to its bare points could not be smaller than about half their
/// spacing, whatever the map; so where the nearest point and its neighbours are flat, it is the distance to the patch
/// of plane through them, which reaches as far as they do. Elsewhere it is the distance to the nearest point.
/// Immutable, safe to share between threads.
class CloudIndex {
 public:
  /// Points that are not finite are left out.
  explicit CloudIndex(const PointCloud& cloud_a);
  ~CloudIndex();
  CloudIndex(const CloudIndex&) = delete;
  CloudIndex& operator=(const CloudIndex&) = delete;

  /// Distance of every point of `cloud_b`, metres, never more than to the nearest point; NaN for points that are not
  /// finite, or when this cloud is empty.
  [[nodiscard]] std::vector<float> distances(const PointCloud& cloud_b, const Pose3& T_a_b = {}) const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

}  // namespace tutti::evaluation
