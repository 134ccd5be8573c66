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

/// How the images of a submap become its visual payload.
struct VisualSubmapConfig {
  TriangulationConfig triangulation;
  double max_residual_px = 5.0;  ///< Largest median residual of tracks, or twice what the odometry explains; above it
                                 ///< calibration or odometry is wrong.
  /// Keep the descriptor most like the landmark's others, and no keypoints without landmark.
  bool one_descriptor_per_landmark = false;
  double budget_kb = 300.0;  ///< Size of a payload, about; the best-observed landmarks are kept.
  bool send_imu = false;     ///< Send what the IMU measured between keyframes, for refining the map.
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

/// The images of a keyframe.
struct KeyframeImages {
  std::uint32_t keyframe = 0;  ///< KeyframeId::index
  Pose3 T_submap_body;         ///< By the odometry.
  std::vector<TrackedImage> images;
  /// Variances per axis that the odometry states for its errors since the submap's begin; they only grow.
  double turn_variance_rad2 = 0.0, shift_variance_m2 = 0.0;
};

/// Makes a payload of a submap's images. Landmarks are the tracks that triangulate() accepts; views that do not fit
/// remain as keypoints. Within the budget the landmarks that most images saw are kept, where images with few kept
/// landmarks count more (the idea of Dymczyk et al. 2015, done greedily); then, in the tracker's order, as many other
/// keypoints of every image as there is room for. The payload's `imu` stays empty. Errors (ErrorCode::invalid): input
/// that contradicts itself (the message says what and where); and a median track that fits no point, or misses its
/// point by more than max_residual_px and twice what odometry and pixels explain, because then calibration, extrinsics,
/// stamps or odometry are wrong.
Result<VisualPayload> make_visual_payload(std::span<const KeyframeImages> images, const std::vector<Camera>& cameras,
                                          const VisualSubmapConfig& config);

}  // namespace tutti::visual
