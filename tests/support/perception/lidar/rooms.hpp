// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <memory>
#include <tuple>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

/// Small worlds of rectangles for the tests of this folder.
namespace tutti::lidar::test {

/// The parallelogram corner + s u + t v, s and t in [0, 1].
struct Rectangle {
  Eigen::Vector3d corner, u, v;
};
using World = std::vector<Rectangle>;

/// All six faces of an axis-parallel box.
inline void add_box(World& world, const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  const Eigen::Vector3d size = high - low;
  const Eigen::Vector3d x(size.x(), 0, 0), y(0, size.y(), 0), z(0, 0, size.z());
  for (const auto& [u, v, other] : {std::tuple(x, y, z), std::tuple(y, z, x), std::tuple(z, x, y)}) {
    world.push_back({low, u, v});
    world.push_back({low + other, u, v});
  }
}

/// 14 x 9 x 3 m with an annex and furniture that leave no symmetry.
inline World furnished_room() {
  World world;
  add_box(world, {0, 0, 0}, {14, 9, 3});
  add_box(world, {9, 9, 0}, {13, 15, 3});
  add_box(world, {3, 2, 0}, {4.5, 3, 2});
  add_box(world, {9, 6, 0}, {10, 8, 2.5});
  add_box(world, {11, 0, 0}, {14, 1.5, 1.5});
  return world;
}

/// Another room of much the same size.
inline World other_room() {
  World world;
  add_box(world, {0, 0, 0}, {12, 10, 3});
  add_box(world, {5, 4, 0}, {7, 6, 3});
  add_box(world, {0, 7, 0}, {2, 10, 2});
  add_box(world, {10, 2, 0}, {11, 3, 1});
  return world;
}

/// 80 m long, 2.6 m wide, without a single feature along it.
inline World corridor() {
  World world;
  world.push_back({{0, 0, 0}, {80, 0, 0}, {0, 2.6, 0}});
  world.push_back({{0, 0, 2.5}, {80, 0, 0}, {0, 2.6, 0}});
  world.push_back({{0, 0, 0}, {80, 0, 0}, {0, 0, 2.5}});
  world.push_back({{0, 2.6, 0}, {80, 0, 0}, {0, 0, 2.5}});
  return world;
}

/// The world seen in a mirror, x -> -x.
inline World mirrored(World world) {
  for (auto& rectangle : world)
    for (auto* v : {&rectangle.corner, &rectangle.u, &rectangle.v}) v->x() = -v->x();
  return world;
}

struct Walk {
  Eigen::Vector3d from{2, 5, 1.2}, to{6, 5, 1.2};  ///< World frame.
  double yaw_rad = 0.0;                            ///< The body's, all along.
  double tilt_rad = 0.0;                           ///< The body's about its x axis.
  Pose3 T_odom_world;
  int keyframes = 11;  ///< One second apart.
  double range_m = 15.0;
  double noise_m = 0.02;
  double spacing_m = 0.12;
  double odometry_sigma = 1e-3;  ///< m and rad per step.
};

inline Pose3 pose_on(const Walk& walk, int k) {
  const double share = walk.keyframes > 1 ? static_cast<double>(k) / (walk.keyframes - 1) : 0.0;
  return {so3_exp({0, 0, walk.yaw_rad}) * so3_exp({walk.tilt_rad, 0, 0}), walk.from + share * (walk.to - walk.from)};
}

/// Samples every surface within range of the walk's middle; occlusion is not modelled.
inline PointCloud observe(const World& world, const Walk& walk, Rng rng) {
  const Eigen::Vector3d middle = 0.5 * (walk.from + walk.to);
  const Pose3 T_submap_world = pose_on(walk, 0).inverse();
  PointCloud cloud;
  for (const auto& rectangle : world) {
    const int rows = std::max(1, static_cast<int>(rectangle.u.norm() / walk.spacing_m));
    const int columns = std::max(1, static_cast<int>(rectangle.v.norm() / walk.spacing_m));
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        Eigen::Vector3d p = rectangle.corner + (i + rng.uniform(0, 1)) / rows * rectangle.u +
                            (j + rng.uniform(0, 1)) / columns * rectangle.v;
        if ((p - middle).norm() > walk.range_m) continue;
        p += Eigen::Vector3d(rng.normal(walk.noise_m), rng.normal(walk.noise_m), rng.normal(walk.noise_m));
        cloud.points.push_back((T_submap_world * p).cast<float>());
      }
  }
  return voxel_downsample(cloud, 0.3);
}

inline Submap make_submap(SubmapId id, const World& world, const Walk& walk, const Rng& rng) {
  Submap submap{.id = id};
  for (int k = 0; k < walk.keyframes; ++k) {
    submap.keyframes.push_back({.index = static_cast<std::uint32_t>(100 * id.index + static_cast<std::uint32_t>(k)),
                                .stamp = Timestamp{1'000'000'000LL * k},
                                .T_odom_body = walk.T_odom_world * pose_on(walk, k)});
    if (k == 0) continue;
    const Matrix6d covariance = walk.odometry_sigma * walk.odometry_sigma * Matrix6d::Identity();
    submap.odometry.push_back({pose_on(walk, k - 1).inverse() * pose_on(walk, k), covariance});
  }
  submap.cloud = std::make_shared<PointCloud>(observe(world, walk, rng));
  return submap;
}

/// T_a_b between the submap frames of two walks in one world.
inline Pose3 true_relative(const Walk& a, const Walk& b) { return pose_on(a, 0).inverse() * pose_on(b, 0); }

}  // namespace tutti::lidar::test
