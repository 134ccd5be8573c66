// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/submap_features.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <span>
#include <tuple>

#include "tutti/perception/lidar/levelling.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

namespace tutti::lidar {
namespace {

constexpr float kMaxWallTilt = 0.35F;      // |n_z| of a wall: within 20 degrees of vertical
constexpr float kMinFloorTilt = 0.94F;     // |n_z| of a floor or ceiling: within 20 degrees of level
constexpr float kFloorLayer = 0.25F;       // m; floors at different heights are kept apart
constexpr double kPriorPreference = 1.25;  // how much better the body's up must fit than the odometry's

std::string why_unusable(const Submap& submap, std::size_t points, const LidarClosureConfig& config) {
  if (points < static_cast<std::size_t>(config.min_points))
    return fmt::format("{} points, at least {} needed", points, config.min_points);
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

/// Walls are summed per half cell, floors per cell and layer, both in a deterministic order.
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
  const auto floor_cell = static_cast<float>(cell_m);
  const auto bin = [](float x, float size) { return static_cast<int>(std::floor(x / size)); };
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.normal(i) == Eigen::Vector3f::Zero()) continue;
    const Eigen::Vector3f p = R * cloud.point(i), n = R * cloud.normal(i);
    if (std::abs(n.z()) < kMaxWallTilt)
      walls[{bin(p.x(), wall_cell), bin(p.y(), wall_cell)}].add(p, n);
    else if (std::abs(n.z()) > kMinFloorTilt)
      floors[{bin(p.x(), floor_cell), bin(p.y(), floor_cell), 2 * bin(p.z(), kFloorLayer) + (n.z() > 0.0F)}].add(p, n);
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

/// Panoramas from viewpoints evenly spread along the way.
std::shared_ptr<const std::vector<DepthPanorama>> look_around(const OrientedCloud& cloud,
                                                              std::span<const Eigen::Vector3f> viewpoints,
                                                              const LidarClosureConfig& config) {
  auto panoramas = std::make_shared<std::vector<DepthPanorama>>();
  const auto count = static_cast<std::size_t>(config.visibility_views);
  for (std::size_t k = 0; k < count; ++k)
    panoramas->emplace_back(cloud, viewpoints[(2 * k + 1) * viewpoints.size() / (2 * count)],
                            static_cast<float>(config.voxel_m));
  return panoramas;
}

}  // namespace

SubmapFeatures extract_features(const Submap& submap, const LidarClosureConfig& config) {
  SubmapFeatures features{.id = submap.id};
  // Finite points in Morton order, whatever the submap came with.
  auto points = submap.cloud ? voxel_downsample(*submap.cloud, config.voxel_m).points : std::vector<Eigen::Vector3f>{};
  features.reason = why_unusable(submap, points.size(), config);
  if (!features.reason.empty()) return features;
  const auto poses = poses_in_submap(submap);
  std::vector<Eigen::Vector3f> viewpoints;
  for (const auto& pose : poses) viewpoints.push_back(pose.translation.cast<float>());
  features.cloud = orient(std::move(points), viewpoints, config.normals);
  const Eigen::Vector3d up = find_up(submap, poses, *features.cloud.normals);
  features.R_level_submap = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ());
  features.view = make_view(features.cloud, features.R_level_submap, config.candidates.cell_m);
  features.panoramas = look_around(features.cloud, viewpoints, config);
  features.usable = true;
  return features;
}

}  // namespace tutti::lidar
