// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "tutti/base/ids.hpp"
#include "tutti/geometry/stretch_covariance.hpp"
#include "tutti/model/refusal.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/perception/visual/closure_config.hpp"
#include "tutti/perception/visual/descriptor_tables.hpp"

namespace tutti::visual {

/// A landmark with what is known of its position.
struct MappedPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();       ///< Submap frame, m.
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< Its largest standard deviation is the landmark's.
};

/// An image that asks where it was taken.
struct QueryFrame {
  std::uint32_t camera = 0;
  std::vector<Observation> observations;  ///< All with a row of `descriptors`: their own, or else their landmark's.
};

struct QueryKeyframe {
  std::uint32_t index = 0;  ///< KeyframeId::index
  std::size_t place = 0;    ///< In Submap::keyframes.
  Pose3 T_submap_body;
  std::vector<QueryFrame> frames;
  std::vector<std::uint32_t> landmarks;  ///< Seen by it; increasing, each once.
};

/// A submap's visual payload, ready to be compared.
struct SubmapFeatures {
  SubmapId id;
  std::optional<Refusal> refusal;  ///< Why it cannot be compared with any other; then the rest is not to be used.
  std::vector<Camera> cameras;
  std::vector<MappedPoint> points;                           ///< By landmark.
  Descriptors descriptors;                                   ///< Of the payload.
  std::vector<TableKeys> keys;                               ///< Of its rows.
  Descriptors landmark_descriptors;                          ///< Those of landmarks alone.
  std::vector<std::uint32_t> landmark_of_row;                ///< Of landmark_descriptors.
  std::vector<std::vector<std::uint32_t>> rows_of_landmark;  ///< The inverse.
  DescriptorTables tables;                                   ///< Of landmark_descriptors.
  std::vector<QueryKeyframe> keyframes;
  StretchCovariance odometry;  ///< Between Submap::keyframes.
  double residual_px = 0.0;    ///< RMS of the landmarks in the submap's own images.
};

/// submap.visual must be set where there is one; its indices are valid (check_payload, where it came from outside).
SubmapFeatures extract_features(const Submap& submap, const VisualClosureConfig& config);

/// Memory held.
std::size_t bytes_of(const SubmapFeatures& features);

}  // namespace tutti::visual
