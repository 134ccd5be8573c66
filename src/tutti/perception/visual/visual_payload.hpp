// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/visual.hpp"
#include "tutti/perception/visual/triangulate.hpp"

namespace tutti::visual {

/// How the images of a submap become its payload.
struct VisualSubmapConfig {
  TriangulationConfig triangulation;
  double max_residual_px = 5.0;  ///< Or twice what the odometry explains: more, and calibration or odometry is wrong.
  bool one_descriptor_per_landmark = false;  ///< The one most like its others; keypoints without landmark are dropped.
  double budget_kb = 300.0;                  ///< Of a submap; the best-observed landmarks are kept.
  bool send_imu = false;                     ///< What the IMU measured between keyframes, for who adjusts the map.
  template <class V>
  void describe(V& v) {
    v.field("max_residual_px", max_residual_px, greater_than(0.0),
            "Half of a submap's tracks reproject within this (RMS of a track), or within twice what pixels and the "
            "odometry's covariance explain; else its images are not believed at all.");
    v.field("one_descriptor_per_landmark", one_descriptor_per_landmark, any(),
            "Keep one descriptor of a landmark instead of one per image, and no keypoint without a landmark.");
    v.field("budget_kb", budget_kb, greater_than(0.0), "Size of a submap's visual payload, about.");
    v.field("send_imu", send_imu, any(),
            "Submaps carry what the IMU measured between keyframes, about 0.8 kB a keyframe: only "
            "refinement.merge.use_imu makes use of it.");
  }
};

/// What a keyframe's cameras saw.
struct KeyframeImages {
  std::uint32_t keyframe = 0;  ///< KeyframeId::index
  Pose3 T_submap_body;         ///< By the odometry.
  std::vector<TrackedImage> images;
  /// What the odometry says of its own errors since the submap's begin, of each axis: growing.
  double turn_variance_rad2 = 0.0, shift_variance_m2 = 0.0;
};

/// Landmarks are the tracks that triangulate() accepts; views that do not fit them remain as keypoints. The budget
/// keeps those that most images saw, but images that have few kept ones count more (the idea of Dymczyk et al. 2015,
/// greedily), then as many of the other keypoints of every image as there is room for, in the tracker's order. The
/// payload's imu stays empty. Fails on input that contradicts itself (which, and where), and where the median track
/// misses its point by more than max_residual_px and twice what is expected (told, with the residual) or fits none:
/// then calibration, extrinsics, stamps or odometry are wrong.
Result<VisualPayload> make_visual_payload(std::span<const KeyframeImages> images, const std::vector<Camera>& cameras,
                                          const VisualSubmapConfig& config);

}  // namespace tutti::visual
