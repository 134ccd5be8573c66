// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/submap_features.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>

#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/visual/reprojection.hpp"
#include "tutti/perception/visual/triangulate.hpp"

namespace tutti::visual {
namespace {

struct Place {
  std::size_t index = 0;  // in Submap::keyframes
  Pose3 T_submap_body;
};
using Places = std::map<std::uint32_t, Place>;  // by KeyframeId::index

Places places_of(const Submap& submap) {
  Places out;
  const Pose3 T_submap_odom = submap.keyframes.front().T_odom_body.inverse();
  for (std::size_t k = 0; k < submap.keyframes.size(); ++k)
    out[submap.keyframes[k].index] = {k, T_submap_odom * submap.keyframes[k].T_odom_body};
  return out;
}

SegmentCovariance odometry_of(const Submap& submap) {
  std::vector<Pose3> poses;
  for (const Keyframe& keyframe : submap.keyframes) poses.push_back(keyframe.T_odom_body);
  std::vector<Matrix6d> steps{Matrix6d::Zero()};
  for (const RelativePose& step : submap.odometry) steps.push_back(step.covariance);
  return {poses, steps};
}

/// The shape that the views give it, in the size that whoever triangulated it states.
MappedPoint map_point(const Landmark& landmark, const std::vector<View>& views) {
  MappedPoint out{landmark.position.cast<double>(), Eigen::Matrix3d::Identity()};
  const double variance = static_cast<double>(landmark.sigma_m) * landmark.sigma_m;
  const auto [values, vectors] = eigen_of(point_information(views, out.position));
  const double least = values[0];
  if (least > 0.0 && std::isfinite(least)) {
    const Eigen::Vector3d shape = (values / least).cwiseInverse();  // at most 1
    out.covariance_m2 = vectors * shape.asDiagonal() * vectors.transpose();
    out.covariance_m2 *= variance > 0.0 ? 1.0 : 1.0 / least;
  }
  if (variance > 0.0) out.covariance_m2 *= variance;
  return out;
}

/// Fills points.
void map_points(const VisualPayload& payload, const Places& places, SubmapFeatures& out) {
  std::vector<std::vector<View>> views(payload.landmarks.size());
  for (const VisualFrame& frame : payload.frames) {
    const Camera& camera = payload.cameras[frame.camera];
    const Pose3 T_camera_submap = (places.at(frame.keyframe).T_submap_body * camera.T_body_camera).inverse();
    for (const Observation& o : frame.observations)
      if (o.landmark != kNoIndex)
        views[o.landmark].push_back({&camera.model, T_camera_submap, o.pixel.cast<double>(), o.sigma_px});
  }
  for (std::size_t l = 0; l < views.size(); ++l) out.points.push_back(map_point(payload.landmarks[l], views[l]));
}

/// Fills the landmarks' descriptors; returns of each landmark a row of the payload's, or kNoIndex.
std::vector<std::uint32_t> describe_landmarks(const VisualPayload& payload, SubmapFeatures& out) {
  std::vector<std::uint32_t> row_of(payload.landmarks.size(), kNoIndex);
  Descriptors& rows = out.landmark_descriptors;
  out.rows_of_landmark.resize(payload.landmarks.size());
  rows = {.kind = payload.descriptors.kind, .words = payload.descriptors.words};
  for (const VisualFrame& frame : payload.frames)
    for (const Observation& o : frame.observations) {
      if (o.landmark == kNoIndex || o.descriptor == kNoIndex) continue;
      if (row_of[o.landmark] == kNoIndex) row_of[o.landmark] = o.descriptor;
      const auto row = payload.descriptors.row(o.descriptor);
      rows.bits.insert(rows.bits.end(), row.begin(), row.end());
      out.rows_of_landmark[o.landmark].push_back(static_cast<std::uint32_t>(out.landmark_of_row.size()));
      out.landmark_of_row.push_back(o.landmark);
    }
  return row_of;
}

void add_queries(const VisualPayload& payload, const Places& places, const std::vector<std::uint32_t>& row_of,
                 SubmapFeatures& out) {
  for (const VisualFrame& frame : payload.frames) {
    if (out.keyframes.empty() || out.keyframes.back().index != frame.keyframe) {
      const Place& place = places.at(frame.keyframe);
      out.keyframes.push_back({frame.keyframe, place.index, place.T_submap_body, {}, {}});
    }
    QueryKeyframe& keyframe = out.keyframes.back();
    QueryFrame query{frame.camera, {}};
    for (Observation o : frame.observations) {
      if (o.landmark != kNoIndex) keyframe.landmarks.push_back(o.landmark);
      if (o.descriptor == kNoIndex && o.landmark != kNoIndex) o.descriptor = row_of[o.landmark];
      if (o.descriptor != kNoIndex) query.observations.push_back(o);
    }
    keyframe.frames.push_back(std::move(query));
  }
  for (QueryKeyframe& keyframe : out.keyframes) {
    std::ranges::sort(keyframe.landmarks);
    const auto rest = std::ranges::unique(keyframe.landmarks);
    keyframe.landmarks.erase(rest.begin(), rest.end());
  }
}

std::optional<Refusal> why_unusable(const SubmapFeatures& features, const std::vector<std::uint32_t>& row_of,
                                    const VisualClosureConfig& config) {
  const auto described = std::ranges::count_if(row_of, [](std::uint32_t row) { return row != kNoIndex; });
  for (const Refusal& gate : {Refusal{RefusalReason::landmark_residual, features.residual_px, config.max_residual_px},
                              Refusal{RefusalReason::too_few_landmarks, static_cast<double>(described),
                                      static_cast<double>(config.min_landmarks)}})
    if (misses(gate)) return gate;
  return std::nullopt;
}

}  // namespace

SubmapFeatures extract_features(const Submap& submap, const VisualClosureConfig& config) {
  SubmapFeatures out{.id = submap.id};
  if (submap.visual == nullptr || submap.keyframes.empty()) {
    out.refusal = Refusal{RefusalReason::no_images};
    return out;
  }
  const VisualPayload& payload = *submap.visual;
  const Places places = places_of(submap);
  out.odometry = odometry_of(submap);
  out.cameras = payload.cameras;
  out.descriptors = payload.descriptors;
  out.keys = table_keys(out.descriptors);
  map_points(payload, places, out);
  out.residual_px = reprojection_error(submap).rms_px();
  const auto row_of = describe_landmarks(payload, out);
  out.tables = DescriptorTables(table_keys(out.landmark_descriptors));
  add_queries(payload, places, row_of, out);
  out.refusal = why_unusable(out, row_of, config);
  return out;
}

std::size_t bytes_of(const SubmapFeatures& features) {
  const auto bytes = [](const auto& values) { return values.capacity() * sizeof(values[0]); };
  std::size_t out = sizeof(features) + bytes(features.cameras) + bytes(features.points) +
                    bytes(features.descriptors.bits) + bytes(features.landmark_descriptors.bits) +
                    bytes(features.keys) + bytes(features.landmark_of_row) + features.tables.bytes() +
                    bytes(features.keyframes);
  for (const auto& rows : features.rows_of_landmark) out += sizeof(rows) + bytes(rows);
  for (const QueryKeyframe& keyframe : features.keyframes) {
    out += bytes(keyframe.frames) + bytes(keyframe.landmarks);
    for (const QueryFrame& frame : keyframe.frames) out += bytes(frame.observations);
  }
  return out + features.odometry.bytes();
}

}  // namespace tutti::visual
