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
  double max_misfit_share = 0.5;  ///< Of the tracks with parallax: more, and calibration or odometry is wrong.
  bool one_descriptor_per_landmark = false;  ///< The one most like its others; keypoints without landmark are dropped.
  double budget_kb = 300.0;                  ///< Of a submap; the best-observed landmarks are kept.
  template <class V>
  void describe(V& v) {
    v.field("triangulation", triangulation, any(), "Landmarks from tracks.");
    v.field("max_misfit_share", max_misfit_share, between(0.0, 1.0),
            "Share of the tracks that may miss the odometry's poses before the images are not believed at all.");
    v.field("one_descriptor_per_landmark", one_descriptor_per_landmark, any(),
            "Keep one descriptor of a landmark instead of one per image, and no keypoint without a landmark.");
    v.field("budget_kb", budget_kb, greater_than(0.0), "Size of a submap's visual payload, about.");
  }
};

/// What a keyframe's cameras saw.
struct KeyframeImages {
  std::uint32_t keyframe = 0;  ///< KeyframeId::index
  Pose3 T_submap_body;         ///< By the odometry.
  std::vector<TrackedImage> images;
};

/// Landmarks are the tracks that triangulate() accepts; views that do not fit them remain as keypoints. The budget
/// keeps those that most images saw, but images that have few kept ones count more (the idea of Dymczyk et al. 2015,
/// greedily), then as many of the other keypoints of every image as there is room for, in the tracker's order. The
/// payload's imu stays empty. Fails on input that contradicts itself (which, and where), and with the residual where
/// more than max_misfit_share of the tracks fit no point: then calibration, extrinsics, stamps or odometry are wrong.
Result<VisualPayload> make_visual_payload(std::span<const KeyframeImages> images, const std::vector<Camera>& cameras,
                                          const VisualSubmapConfig& config);

}  // namespace tutti::visual
