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

/// Statistics of the distances between the points of one cloud and the surface that another cloud describes. Every
/// point counts the same, so thin both clouds to equal voxels first; otherwise places that were seen often count more.
struct CloudDistance {
  std::size_t points = 0;
  double mean_m = 0.0;
  double rms_m = 0.0;
  double p95_m = 0.0;        ///< 95 % of the points are at most this far.
  double within_10cm = 0.0;  ///< This and the next two: shares of the points, 0 to 1.
  double within_30cm = 0.0;
  double within_1m = 0.0;
};

/// Statistics of the finite distances; no value when none is finite.
std::optional<CloudDistance> summarise(std::span<const float> distances_m);

/// The cloud that distances are measured to. Distances to bare points would hardly be smaller than half of the points'
/// spacing, however good the map. So where the nearest point and its 7 neighbours are flat, the distance is that to the
/// patch of plane through these points, which reaches as far as they do; elsewhere it is that to the nearest point.
/// Immutable, safe to share between threads.
class CloudIndex {
 public:
  /// Points that are not finite are left out.
  explicit CloudIndex(const PointCloud& cloud_a);
  ~CloudIndex();
  CloudIndex(const CloudIndex&) = delete;
  CloudIndex& operator=(const CloudIndex&) = delete;

  /// Distance of every point of `cloud_b`, m, never larger than that to the nearest point; NaN for points that are not
  /// finite, and for all points when this cloud is empty.
  [[nodiscard]] std::vector<float> distances(const PointCloud& cloud_b, const Pose3& T_a_b = {}) const;

 private:
  struct Tree;
  std::unique_ptr<const Tree> tree_;
};

}  // namespace tutti::evaluation
