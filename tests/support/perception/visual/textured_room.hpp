// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/model/submap.hpp"
#include "tutti/perception/visual/visual_payload.hpp"

/// Points with descriptors on the walls of a room, cameras like EuRoC's, and flights along the walls: what a tracker
/// would give of them, with known truth.
namespace tutti::visual::test {

/// Like EuRoC's cam0 and cam1; x of the body looks forward, y to the left. The second is `baseline` times as far from
/// the first as EuRoC's.
inline std::vector<Camera> stereo_cameras(double baseline = 1.0) {
  const CameraModel model{.kind = CameraKind::pinhole,
                          .width_px = 752,
                          .height_px = 480,
                          .fx = 458.7,
                          .fy = 457.3,
                          .cx = 367.2,
                          .cy = 248.4,
                          .distortion = {-0.283, 0.074, 0.0002, 0.00002}};
  Eigen::Matrix3d R_body_camera;
  R_body_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::Quaterniond q(R_body_camera);
  return {{model, {q, {0.05, 0.055, 0.0}}}, {model, {q, {0.05, 0.055 - 2.0 * 0.055 * baseline, 0.0}}}};
}

inline constexpr std::uint32_t kWords = 6;
using Bits = std::vector<std::uint64_t>;

struct RoomPoint {
  Eigen::Vector3d position;  // world
  Bits descriptor;
};

inline Bits random_bits(Rng& rng) {
  Bits out;
  for (std::uint32_t w = 0; w < kWords; ++w) out.push_back(rng.index(~std::uint64_t{0}));
  return out;
}

/// 8 x 6 x 3 m, points on the walls and 0.5 m in front of them.
inline std::vector<RoomPoint> textured_room(std::size_t points, Rng rng) {
  std::vector<RoomPoint> out;
  for (std::size_t i = 0; i < points; ++i) {
    const double depth = rng.uniform(0.0, 0.5), along = rng.uniform(0.0, 1.0), z = rng.uniform(0.0, 3.0);
    Eigen::Vector3d p;
    switch (rng.index(4)) {
      case 0:
        p = {8.0 * along, depth, z};
        break;
      case 1:
        p = {8.0 * along, 6.0 - depth, z};
        break;
      case 2:
        p = {depth, 6.0 * along, z};
        break;
      default:
        p = {8.0 - depth, 6.0 * along, z};
    }
    out.push_back({p, random_bits(rng)});
  }
  return out;
}

/// Keyframes on a straight line that look to one side, and how well they see.
struct Flight {
  Eigen::Vector3d from{2.0, 2.0, 1.4};
  Eigen::Vector3d to{5.0, 2.4, 1.6};
  double yaw_rad = 1.5;  ///< Where x of the body points, turning by turn_rad over the flight.
  double turn_rad = 0.3;
  std::uint32_t keyframes = 10;
  std::uint32_t cameras = 1;
  std::uint32_t first_keyframe = 0;
  double start_s = 0.0;
  double pixel_noise_px = 0.5;
  double bit_flips = 0.05;        ///< Probability of each bit.
  double odometry_noise_m = 0.0;  ///< Each keyframe's position.
  Pose3 T_odom_world;
};

inline Pose3 true_pose(const Flight& f, std::uint32_t k) {  // T_world_body
  const double t = f.keyframes > 1 ? static_cast<double>(k) / (f.keyframes - 1) : 0.0;
  return {so3_exp((f.yaw_rad + t * f.turn_rad) * Eigen::Vector3d::UnitZ()), f.from + t * (f.to - f.from)};
}

inline TrackedImage look(const std::vector<RoomPoint>& room, const Camera& camera, std::uint32_t index,
                         const Pose3& T_world_body, const Flight& f, Rng& rng) {
  TrackedImage out{.camera = index, .descriptors = {.kind = DescriptorKind::maplab, .words = kWords}};
  const Pose3 T_camera_world = (T_world_body * camera.T_body_camera).inverse();
  for (std::size_t i = 0; i < room.size(); ++i) {
    const auto pixel = project(camera.model, T_camera_world * room[i].position);
    if (!pixel) continue;
    const Eigen::Vector2d noisy = *pixel + f.pixel_noise_px * Eigen::Vector2d(rng.normal(), rng.normal());
    if (!in_image(camera.model, noisy, 2.0)) continue;
    out.keypoints.push_back({noisy.cast<float>(), static_cast<float>(std::max(0.1, f.pixel_noise_px)), i + 1});
    for (std::uint64_t word : room[i].descriptor) {
      for (int bit = 0; bit < 64; ++bit) word ^= static_cast<std::uint64_t>(rng.bernoulli(f.bit_flips)) << bit;
      out.descriptors.bits.push_back(word);
    }
  }
  return out;
}

/// A flight as its robot knows it.
struct Seen {
  std::vector<KeyframeImages> images;
  std::vector<Keyframe> keyframes;
  Pose3 T_world_submap;
};

inline Seen fly(const std::vector<RoomPoint>& room, const std::vector<Camera>& cameras, const Flight& f, Rng rng) {
  Seen out{.T_world_submap = true_pose(f, 0)};
  for (std::uint32_t k = 0; k < f.keyframes; ++k) {
    const Pose3 T_world_body = true_pose(f, k);
    Pose3 T_submap_body = out.T_world_submap.inverse() * T_world_body;
    if (k > 0)
      T_submap_body.translation += f.odometry_noise_m * Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal());
    KeyframeImages keyframe{f.first_keyframe + k, T_submap_body, {}};
    for (std::uint32_t c = 0; c < f.cameras; ++c)
      keyframe.images.push_back(look(room, cameras[c], c, T_world_body, f, rng));
    out.images.push_back(std::move(keyframe));
    out.keyframes.push_back(
        {f.first_keyframe + k, Timestamp{} + (f.start_s + k), f.T_odom_world * out.T_world_submap * T_submap_body});
  }
  return out;
}

/// The flight as a submap, its odometry as sure as it states.
inline Submap make_submap(SubmapId id, const Seen& seen, const std::vector<Camera>& cameras,
                          const VisualSubmapConfig& config = {}, double sigma_m = 0.01, double sigma_rad = 0.002) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(sigma_m), Eigen::Vector3d::Constant(sigma_rad);
  Submap out{.id = id, .keyframes = seen.keyframes};
  for (std::size_t k = 1; k < seen.keyframes.size(); ++k)
    out.odometry.push_back(
        {seen.keyframes[k - 1].T_odom_body.inverse() * seen.keyframes[k].T_odom_body, sigma.cwiseAbs2().asDiagonal()});
  out.visual = std::make_shared<const VisualPayload>(make_visual_payload(seen.images, cameras, config).value());
  return out;
}

}  // namespace tutti::visual::test
