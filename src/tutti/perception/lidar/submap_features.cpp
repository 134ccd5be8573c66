// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/submap_features.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include "tutti/geometry/so3.hpp"
#include "tutti/model/path_length.hpp"
#include "tutti/perception/lidar/levelling.hpp"
#include "tutti/perception/lidar/registration.hpp"
#include "tutti/perception/lidar/submap_middle.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::lidar {
namespace {

constexpr double kPriorPreference = 1.25;  // how much better the body's up must fit than the odometry's

std::optional<Refusal> why_unusable(const Submap& submap, std::size_t points, const LidarClosureConfig& config) {
  if (points < static_cast<std::size_t>(config.min_points))
    return Refusal{RefusalReason::too_small, static_cast<double>(points), static_cast<double>(config.min_points)};
  if (submap.keyframes.size() < static_cast<std::size_t>(config.min_keyframes))
    return Refusal{RefusalReason::too_few_keyframes, static_cast<double>(submap.keyframes.size()),
                   static_cast<double>(config.min_keyframes)};
  const double duration_s = submap.keyframes.back().stamp - submap.keyframes.front().stamp;
  if (duration_s < config.min_duration_s && path_length_m(submap.odometry) < config.min_distance_m)
    return Refusal{RefusalReason::too_short, duration_s, config.min_duration_s};
  return std::nullopt;
}

std::vector<Pose3> poses_in_submap(const Submap& submap) {
  std::vector<Pose3> out;
  const Pose3 T_submap_odom = submap.keyframes.front().T_odom_body.inverse();
  for (const auto& keyframe : submap.keyframes) out.push_back(T_submap_odom * keyframe.T_odom_body);
  return out;
}

/// Up in the submap frame. Odometry frames are usually level to a few degrees; where one is not, the mean up of the
/// body may be. The surfaces decide, and refine.
Eigen::Vector3d find_up(const Submap& submap, std::span<const Pose3> poses, std::span<const Eigen::Vector3f> normals) {
  const Eigen::Vector3d odom_up = submap.keyframes.front().T_odom_body.rotation.conjugate() * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d body_up = Eigen::Vector3d::Zero();
  for (const auto& pose : poses) body_up += pose.rotation * Eigen::Vector3d::UnitZ();
  const UpDirection by_odometry = refine_up(normals, odom_up);
  if (body_up.norm() < 0.5 * static_cast<double>(poses.size())) return by_odometry.up;
  const UpDirection by_body = refine_up(normals, body_up.normalized());
  return by_body.support > kPriorPreference * by_odometry.support ? by_body.up : by_odometry.up;
}

/// The points' expected residuals where two submaps of one place lie on each other: those within one cloud, and how far
/// the odometry's rotation may have bent it. Not its translation: that is uncertain along corridors without features,
/// where the few points that determine how far along one is must not be excused.
std::vector<float> expected_residuals(const OrientedCloud& cloud, const Middle& middle,
                                      const RegistrationConfig& config) {
  std::vector<float> out = self_residuals(cloud, config);
  const Pose3& T_submap_middle = middle.T_submap_keyframe;
  const Eigen::Matrix3d R = T_submap_middle.rotation.toRotationMatrix();
  const Eigen::Matrix3d bend = R * middle.covariance.bottomRightCorner<3, 3>() * R.transpose();
  for (std::size_t i = 0; i < out.size(); ++i) {
    if (std::isnan(out[i])) continue;
    const Eigen::Vector3d arm = cloud.point(i).cast<double>() - T_submap_middle.translation;
    const Eigen::Vector3d lever = arm.cross(cloud.normal(i).cast<double>());
    out[i] = static_cast<float>(std::sqrt(double{out[i]} * out[i] + lever.dot(bend * lever)));
  }
  return out;
}

/// Panoramas from viewpoints evenly spread along the trajectory.
std::shared_ptr<const std::vector<DepthPanorama>> render_panoramas(const OrientedCloud& cloud,
                                                                   std::span<const Eigen::Vector3f> viewpoints,
                                                                   const LidarClosureConfig& config) {
  auto panoramas = std::make_shared<std::vector<DepthPanorama>>();
  constexpr std::size_t kViews = 5;
  for (std::size_t k = 0; k < kViews; ++k)
    panoramas->emplace_back(cloud, viewpoints[(2 * k + 1) * viewpoints.size() / (2 * kViews)],
                            static_cast<float>(config.voxel_m));
  return panoramas;
}

/// The part of a submap's features that describes its appearance from above.
struct SeenFromAbove {
  std::optional<Refusal> refusal;  ///< Why the submap is not usable; nothing else is there then.
  std::vector<Eigen::Vector3f> viewpoints;
  OrientedCloud cloud;
  Eigen::Quaterniond R_level_submap = Eigen::Quaterniond::Identity();
  BirdsEyeView view;
};

SeenFromAbove see_from_above(const Submap& submap, const LidarClosureConfig& config) {
  SeenFromAbove out;
  // Finite points in Morton order, whatever the submap came with.
  auto points = submap.cloud ? voxel_downsample(*submap.cloud, config.voxel_m).points : std::vector<Eigen::Vector3f>{};
  out.refusal = why_unusable(submap, points.size(), config);
  if (out.refusal) return out;
  const auto poses = poses_in_submap(submap);
  for (const auto& pose : poses) out.viewpoints.push_back(pose.translation.cast<float>());
  out.cloud = orient(std::move(points), out.viewpoints, config.normals);
  const Eigen::Vector3d up = find_up(submap, poses, *out.cloud.normals);
  out.R_level_submap = rotation_between(up, Eigen::Vector3d::UnitZ());
  out.view = make_view(out.cloud, out.R_level_submap, config.candidates.cell_m);
  return out;
}

}  // namespace

SubmapFeatures extract_features(const Submap& submap, const LidarClosureConfig& config) {
  SeenFromAbove seen = see_from_above(submap, config);
  SubmapFeatures features{.id = submap.id, .refusal = seen.refusal};
  if (features.refusal) return features;
  const Middle middle = find_middle(submap);
  features.middle = middle.T_submap_keyframe.translation;
  features.bend = std::make_shared<const Bend>(find_bend(submap));
  features.cloud = std::move(seen.cloud);
  features.cloud.roughness =
      std::make_shared<const std::vector<float>>(expected_residuals(features.cloud, middle, config.registration));
  features.R_level_submap = seen.R_level_submap;
  features.view = std::move(seen.view);
  features.turned_views = std::make_shared<const std::vector<TurnedView>>(turn_views(features.view, config.candidates));
  features.panoramas = render_panoramas(features.cloud, seen.viewpoints, config);
  features.usable = true;
  return features;
}

SubmapFeatures turned_over(SubmapFeatures features, const LidarClosureConfig& config) {
  if (!features.usable) return features;
  features.R_level_submap = Eigen::Quaterniond(0.0, 1.0, 0.0, 0.0) * features.R_level_submap;  // half a turn about x
  features.view = make_view(features.cloud, features.R_level_submap, config.candidates.cell_m);
  features.turned_views = std::make_shared<const std::vector<TurnedView>>(turn_views(features.view, config.candidates));
  return features;
}

std::vector<TurnedView> views_from_above(const Submap& submap, const LidarClosureConfig& config) {
  const SeenFromAbove seen = see_from_above(submap, config);
  if (seen.refusal || !has_enough_walls(seen.view)) return {};
  return turn_views(seen.view, config.candidates);
}

std::size_t bytes_of(const SubmapFeatures& features) {
  const auto of_elements = [](const auto& vector) { return vector.capacity() * sizeof(vector[0]); };
  std::size_t bytes = sizeof features + of_elements(features.view.walls) + of_elements(features.view.floors);
  if (features.cloud.index) bytes += features.cloud.index->bytes();
  if (features.cloud.normals) bytes += of_elements(*features.cloud.normals);
  if (features.cloud.surface) bytes += of_elements(*features.cloud.surface);
  if (features.cloud.roughness) bytes += of_elements(*features.cloud.roughness);
  if (features.bend) bytes += of_elements(features.bend->viewpoints) + of_elements(features.bend->steps);
  if (features.turned_views)
    for (const TurnedView& view : *features.turned_views)
      bytes += sizeof view + static_cast<std::size_t>(view.spectrum.size()) * sizeof(view.spectrum(0));
  if (features.panoramas)
    for (const DepthPanorama& panorama : *features.panoramas) bytes += panorama.bytes();
  return bytes;
}

}  // namespace tutti::lidar
