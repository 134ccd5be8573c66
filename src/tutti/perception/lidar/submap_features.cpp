// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/submap_features.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <tuple>

#include "tutti/perception/lidar/levelling.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::lidar {
namespace {

constexpr float kMaxWallTilt = 0.35F;   // |n_z| of a wall: within 20 degrees of vertical
constexpr float kMinFloorTilt = 0.94F;  // |n_z| of a floor or ceiling: within 20 degrees of level
constexpr double kPriorPreference = 1.25;

std::string why_unusable(const Submap& submap, const LidarClosureConfig& config) {
  if (!submap.cloud || submap.cloud->points.size() < static_cast<std::size_t>(config.min_points))
    return fmt::format("{} points, at least {} needed", submap.cloud ? submap.cloud->points.size() : 0,
                       config.min_points);
  if (submap.keyframes.size() < static_cast<std::size_t>(config.min_keyframes))
    return fmt::format("{} keyframes, at least {} needed", submap.keyframes.size(), config.min_keyframes);
  const double duration = submap.keyframes.back().stamp - submap.keyframes.front().stamp;
  if (duration < config.min_duration_s)
    return fmt::format("lasts {:.1f} s, at least {:.1f} s needed", duration, config.min_duration_s);
  return {};
}

std::vector<Pose3> poses_in_submap(const Submap& submap) {
  std::vector<Pose3> out;
  const Pose3 T_submap_odom = submap.keyframes.front().T_odom_body.inverse();
  for (const auto& keyframe : submap.keyframes) out.push_back(T_submap_odom * keyframe.T_odom_body);
  return out;
}

/// Finite points, in Morton order and thinned to the submap voxel if they were not already.
std::vector<Eigen::Vector3f> clean(const PointCloud& cloud, double voxel_m) {
  return voxel_downsample(cloud, voxel_m).points;
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

/// Sums wall points per half cell, floors per two cells and 0.25 m of height, both in a deterministic order.
BirdsEyeView make_view(const OrientedCloud& cloud, const Eigen::Quaterniond& R_level_submap, double cell_m) {
  struct Sum {
    Eigen::Vector3f point = Eigen::Vector3f::Zero();
    Eigen::Vector2f normal = Eigen::Vector2f::Zero();
    float count = 0.0F;
    void add(const Eigen::Vector3f& p, const Eigen::Vector3f& n) {
      point += p;
      normal += n.head<2>();
      count += 1.0F;
    }
  };
  std::map<std::pair<int, int>, Sum> walls;
  std::map<std::tuple<int, int, int>, Sum> floors;
  const Eigen::Matrix3f R = R_level_submap.toRotationMatrix().cast<float>();
  const auto wall_cell = static_cast<float>(0.5 * cell_m);
  const auto floor_cell = static_cast<float>(2.0 * cell_m);
  const auto bin = [](float x, float size) { return static_cast<int>(std::floor(x / size)); };
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.normal(i) == Eigen::Vector3f::Zero()) continue;
    const Eigen::Vector3f p = R * cloud.point(i), n = R * cloud.normal(i);
    if (std::abs(n.z()) < kMaxWallTilt)
      walls[{bin(p.x(), wall_cell), bin(p.y(), wall_cell)}].add(p, n);
    else if (std::abs(n.z()) > kMinFloorTilt)
      floors[{bin(p.x(), floor_cell), bin(p.y(), floor_cell), 2 * bin(p.z(), 0.25F) + (n.z() > 0.0F)}].add(p, n);
  }
  BirdsEyeView view;
  Eigen::Vector2f centre = Eigen::Vector2f::Zero();
  for (const auto& [key, sum] : walls) centre += sum.point.head<2>() / sum.count;
  if (!walls.empty()) centre /= static_cast<float>(walls.size());
  view.centre = centre.cast<double>();
  for (const auto& [key, sum] : walls)
    view.walls.push_back({sum.point.head<2>() / sum.count - centre, sum.normal / std::sqrt(sum.count)});
  for (const auto& [key, sum] : floors)
    view.floors.push_back(
        {sum.point.head<2>() / sum.count - centre, sum.point.z() / sum.count, (std::get<2>(key) & 1) != 0});
  return view;
}

}  // namespace

SubmapFeatures extract_features(const Submap& submap, const LidarClosureConfig& config) {
  SubmapFeatures features{.id = submap.id, .reason = why_unusable(submap, config)};
  if (!features.reason.empty()) return features;
  const auto poses = poses_in_submap(submap);
  std::vector<Eigen::Vector3f> viewpoints;
  for (const auto& pose : poses) viewpoints.push_back(pose.translation.cast<float>());
  features.cloud = orient(clean(*submap.cloud, config.voxel_m), viewpoints, config.normals);
  const Eigen::Vector3d up = find_up(submap, poses, *features.cloud.normals);
  features.R_level_submap = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  features.view = make_view(features.cloud, features.R_level_submap, config.candidates.cell_m);
  auto panoramas = std::make_shared<std::vector<DepthPanorama>>();
  constexpr std::size_t kViews = 5;
  for (std::size_t k = 0; k < kViews; ++k)
    panoramas->emplace_back(features.cloud, viewpoints[k * (viewpoints.size() - 1) / (kViews - 1)],
                            static_cast<float>(config.voxel_m));
  features.panoramas = std::move(panoramas);
  features.usable = true;
  return features;
}

}  // namespace tutti::lidar
