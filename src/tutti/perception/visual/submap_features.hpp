// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/geometry/segment_covariance.hpp"
#include "tutti/model/refusal.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/perception/visual/closure_config.hpp"
#include "tutti/perception/visual/descriptor_tables.hpp"

namespace tutti::visual {

/// A landmark with the uncertainty of its position.
struct MappedPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();       ///< Submap frame, m.
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< Its largest standard deviation is Landmark::sigma_m.
};

/// An image to be localised in another submap.
struct QueryFrame {
  std::uint32_t camera = 0;
  std::vector<Observation> observations;  ///< All with a row of `descriptors`: their own, or one of their landmark.
};

/// A keyframe to be localised in another submap.
struct QueryKeyframe {
  std::uint32_t index = 0;  ///< KeyframeId::index
  std::size_t place = 0;    ///< Position in Submap::keyframes.
  Pose3 T_submap_body;
  std::vector<QueryFrame> frames;
  std::vector<std::uint32_t> landmarks;  ///< Landmarks that it saw; increasing, each once.
};

/// A submap's visual payload, prepared for verify_pair().
struct SubmapFeatures {
  SubmapId id;
  /// Why no pair with this submap can be verified; then the other fields are not to be used.
  std::optional<Refusal> refusal;
  std::vector<Camera> cameras;
  std::vector<MappedPoint> points;                           ///< By landmark.
  Descriptors descriptors;                                   ///< The payload's.
  std::vector<TableKeys> keys;                               ///< Per row of `descriptors`.
  Descriptors landmark_descriptors;                          ///< Those of landmarks' views alone.
  std::vector<std::uint32_t> landmark_of_row;                ///< Per row of landmark_descriptors.
  std::vector<std::vector<std::uint32_t>> rows_of_landmark;  ///< The inverse.
  DescriptorTables tables;                                   ///< Over landmark_descriptors.
  std::vector<QueryKeyframe> keyframes;
  SegmentCovariance odometry;  ///< Odometry between Submap::keyframes.
  double residual_px = 0.0;    ///< RMS of the landmarks in the submap's own images.
};

/// Computes the features; a submap without images or with a poor payload gets a refusal. submap.visual must be loaded
/// where there is one, and its indices valid, as wire::decode_submap() checks.
SubmapFeatures extract_features(const Submap& submap, const VisualClosureConfig& config);

/// Memory used, in bytes.
std::size_t bytes_of(const SubmapFeatures& features);

}  // namespace tutti::visual
