// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "support/random_pose.hpp"
#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/estimation/imu_preintegration.hpp"

namespace tutti::bundle {

/// A robot that flies circles in a room of 8 x 8 x 3 m and looks across it, with known truth.
struct SceneOptions {
  int keyframes = 24;
  int keyframes_per_circle = 20;
  int keyframes_per_submap = 8;  ///< The first one of which is the last of the submap before.
  int points = 300;
  double pixel_sigma = 1.0;
  double odometry_sigma_m = 0.02, odometry_sigma_rad = 0.005;  ///< Per step.
  double odometry_scale_sigma = 0.0;                           ///< All its steps' together, beside that.
  double start_sigma_m = 0.03, start_sigma_rad = 0.005;        ///< The poses' that a refinement starts from.
  ImuNoise imu_noise;
  estimation::ImuBias imu_bias{{0.02, -0.05, 0.08}, {0.1, -0.2, 0.05}};
  bool imu = false;
  int cameras = 1;       ///< The second one 0.2 m to the right of the first,
  Pose3 T_second_given;  ///< ... and where the calibration has it: by this from there, in its frame.
};

inline constexpr double kKeyframePeriod_s = 1.0;
inline const Eigen::Vector3d kSceneGravity{0.0, 0.0, -9.81};

inline Pose3 scene_pose(double t, int keyframes_per_circle) {
  const double w = 2.0 * std::numbers::pi / (keyframes_per_circle * kKeyframePeriod_s);
  const Eigen::Vector3d position(2.0 * std::cos(w * t), 2.0 * std::sin(w * t), 1.5 + 0.3 * std::sin(3.0 * w * t));
  const Eigen::Quaterniond yaw = so3_exp({0.0, 0.0, w * t + std::numbers::pi});
  return {yaw * so3_exp({0.1 * std::sin(2.0 * w * t), 0.1 * std::cos(3.0 * w * t), 0.0}), position};
}

/// The sample of an ideal IMU at rest in that motion, by central differences.
inline ImuSample scene_imu(double t, int keyframes_per_circle) {
  constexpr double h = 1e-3;
  const Pose3 before = scene_pose(t - h, keyframes_per_circle);
  const Pose3 now = scene_pose(t, keyframes_per_circle);
  const Pose3 after = scene_pose(t + h, keyframes_per_circle);
  const Eigen::Vector3d a = (after.translation - 2.0 * now.translation + before.translation) / (h * h);
  return {Timestamp{} + t, so3_log(before.rotation.conjugate() * after.rotation) / (2.0 * h),
          now.rotation.conjugate() * (a - kSceneGravity)};
}

inline Camera scene_camera(int number = 0) {
  Eigen::Matrix3d R;  // camera z is the body's x, camera x its -y
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {{.kind = CameraKind::pinhole,
           .width_px = 752,
           .height_px = 480,
           .fx = 400.0,
           .fy = 400.0,
           .cx = 375.5,
           .cy = 239.5,
           .distortion = {-0.2, 0.05, 1e-4, -1e-4}},
          {Eigen::Quaterniond(R), {0.05, -0.02 - 0.2 * number, 0.03}}};
}

struct Scene {
  RefinementInput input;
  std::vector<Pose3> truth;  ///< T_world_body per keyframe.
  std::vector<Eigen::Vector3d> points;
  std::map<LandmarkId, std::size_t> point_of;  ///< The point that each landmark really is.
};

class SceneMaker {
 public:
  SceneMaker(const SceneOptions& options, std::uint64_t seed) : options_(options), rng_(seed) {
    for (int k = 0; k < options.keyframes; ++k)
      scene_.truth.push_back(scene_pose(k * kKeyframePeriod_s, options.keyframes_per_circle));
    for (int i = 0; i < options.points; ++i) {
      scene_.points.push_back(on_a_wall());
      descriptors_.push_back({rng_.index(~0ULL), rng_.index(~0ULL)});
    }
    make_odometry();
    for (auto& T : scene_.truth) start_.push_back(moved(T, options.start_sigma_m, options.start_sigma_rad));
    if (options.imu) make_samples();
  }

  Scene make() {
    const int step = options_.keyframes_per_submap - 1;
    for (int first = 0, s = 0; first + 1 < options_.keyframes; first += step, ++s)
      add_submap(static_cast<std::uint32_t>(s), first, std::min(first + step, options_.keyframes - 1));
    std::map<std::size_t, LandmarkId> first_seen;
    for (const auto& [id, point] : scene_.point_of) {
      const auto [it, is_new] = first_seen.try_emplace(point, id);
      if (!is_new && id.submap.index > it->second.submap.index + 1) scene_.input.matches.push_back({it->second, id});
    }
    return std::move(scene_);
  }

 private:
  Eigen::Vector3d on_a_wall() {
    const double along = rng_.uniform(-4.0, 4.0);
    const double up = rng_.uniform(0.0, 3.0);
    const double side = rng_.bernoulli(0.5) ? 4.0 : -4.0;
    return rng_.bernoulli(0.5) ? Eigen::Vector3d(side, along, up) : Eigen::Vector3d(along, side, up);
  }
  Pose3 moved(const Pose3& T, double sigma_m, double sigma_rad) {
    Vector6d xi;
    xi << test::random_vector(rng_, sigma_m), test::random_vector(rng_, sigma_rad);
    return retract(T, xi);
  }

  void make_odometry() {
    const double m = options_.odometry_sigma_m, rad = options_.odometry_sigma_rad;
    const double scale = 1.0 + (options_.odometry_scale_sigma > 0.0 ? rng_.normal(options_.odometry_scale_sigma) : 0.0);
    T_odom_body_.push_back(scene_.truth.front());
    for (std::size_t k = 0; k + 1 < scene_.truth.size(); ++k) {
      RelativePose step{moved(scene_.truth[k].inverse() * scene_.truth[k + 1], m, rad), Matrix6d::Identity()};
      step.T_a_b.translation *= scale;
      step.covariance.diagonal() << m * m, m * m, m * m, rad * rad, rad * rad, rad * rad;
      T_odom_body_.push_back(T_odom_body_.back() * step.T_a_b);
      odometry_.push_back(step);
    }
  }

  void make_samples() {
    constexpr double rate_hz = 200.0;
    const double root = std::sqrt(rate_hz);
    const auto& noise = options_.imu_noise;
    const int count = static_cast<int>((options_.keyframes * kKeyframePeriod_s + 0.1) * rate_hz);
    for (int i = -10; i < count; ++i) {
      ImuSample sample = scene_imu(i / rate_hz, options_.keyframes_per_circle);
      sample.gyro += options_.imu_bias.gyro + test::random_vector(rng_, noise.gyro_noise_density * root);
      sample.accelerometer +=
          options_.imu_bias.accelerometer + test::random_vector(rng_, noise.accelerometer_noise_density * root);
      samples_.push_back(sample);
    }
  }

  /// The views of keyframe k: the same pixels whoever asks.
  const std::map<std::size_t, Eigen::Vector2f>& views(int k, int number) {
    const auto [it, is_new] = views_.try_emplace({k, number});
    if (!is_new) return it->second;
    const Camera camera = scene_camera(number);
    const Pose3 T_camera_world = (scene_.truth[static_cast<std::size_t>(k)] * camera.T_body_camera).inverse();
    for (std::size_t i = 0; i < scene_.points.size(); ++i) {
      const Eigen::Vector3d p = T_camera_world * scene_.points[i];
      if (p.z() < 0.5 || p.z() > 7.0) continue;
      auto pixel = project(camera.model, p);
      if (!pixel || !in_image(camera.model, *pixel)) continue;
      pixel->x() += rng_.normal(options_.pixel_sigma);
      pixel->y() += rng_.normal(options_.pixel_sigma);
      it->second[i] = pixel->cast<float>();
    }
    return it->second;
  }

  void add_submap(std::uint32_t index, int first, int last) {
    auto submap = std::make_shared<Submap>();
    auto visual = std::make_shared<VisualPayload>();
    submap->id = {RobotId{0}, index};
    for (int c = 0; c < options_.cameras; ++c) visual->cameras.push_back(scene_camera(c));
    if (options_.cameras > 1) {
      Pose3& given = visual->cameras[1].T_body_camera;
      given = given * options_.T_second_given;
    }
    visual->descriptors = {.kind = DescriptorKind::orb, .words = 2, .bits = {}};
    std::map<std::size_t, std::uint32_t> landmarks;
    PosedSubmap posed;
    for (int k = first; k <= last; ++k) {
      const auto at = static_cast<std::size_t>(k);
      submap->keyframes.push_back({.index = static_cast<std::uint32_t>(k),
                                   .stamp = Timestamp{} + k * kKeyframePeriod_s,
                                   .T_odom_body = T_odom_body_[at]});
      if (k > first) submap->odometry.push_back(odometry_[at - 1]);
      posed.T_world_body.push_back(start_[at]);
      for (int c = 0; c < options_.cameras; ++c) add_frame(k, c, first, *submap, landmarks, *visual);
    }
    add_imu(*submap, *visual);
    submap->visual = std::move(visual);
    posed.submap = std::move(submap);
    scene_.input.submaps.push_back(std::move(posed));
  }

  void add_frame(int k, int number, int first, const Submap& submap, std::map<std::size_t, std::uint32_t>& landmarks,
                 VisualPayload& visual) {
    VisualFrame frame{
        .keyframe = static_cast<std::uint32_t>(k), .camera = static_cast<std::uint32_t>(number), .observations = {}};
    for (const auto& [point, pixel] : views(k, number)) {
      const auto [it, is_new] = landmarks.try_emplace(point, static_cast<std::uint32_t>(landmarks.size()));
      if (is_new) {
        const Pose3 T_submap_world = scene_.truth[static_cast<std::size_t>(first)].inverse();
        visual.landmarks.push_back(
            {(T_submap_world * scene_.points[point] + test::random_vector(rng_, 0.05)).cast<float>(), 0.05F});
        scene_.point_of[{submap.id, it->second}] = point;
      }
      frame.observations.push_back({.pixel = pixel,
                                    .sigma_px = static_cast<float>(std::max(options_.pixel_sigma, 0.1)),
                                    .landmark = it->second,
                                    .descriptor = static_cast<std::uint32_t>(visual.descriptors.size())});
      for (const std::uint64_t word : descriptors_[point])  // a few bits differ from image to image
        visual.descriptors.bits.push_back(word ^ (1ULL << rng_.index(64)) ^ (1ULL << rng_.index(64)));
    }
    visual.frames.push_back(std::move(frame));
  }

  void add_imu(const Submap& submap, VisualPayload& visual) {
    if (!options_.imu) return;
    const auto bias = estimation::estimate_gyro_bias(samples_, submap.keyframes);
    for (std::size_t k = 0; k + 1 < submap.keyframes.size(); ++k)
      visual.imu.push_back(estimation::preintegrate(samples_, submap.keyframes[k], submap.keyframes[k + 1],
                                                    {.gyro = bias.value_or(Eigen::Vector3d::Zero())},
                                                    options_.imu_noise)
                               .value());
  }

  SceneOptions options_;
  Rng rng_;
  Scene scene_;
  std::vector<Pose3> T_odom_body_, start_;
  std::vector<std::array<std::uint64_t, 2>> descriptors_;  ///< Per point.
  std::vector<RelativePose> odometry_;
  std::vector<ImuSample> samples_;
  std::map<std::pair<int, int>, std::map<std::size_t, Eigen::Vector2f>> views_;
};

inline Scene make_scene(const SceneOptions& options, std::uint64_t seed) { return SceneMaker(options, seed).make(); }

/// Everything of the scene, nothing added to its odometry: as the truth is made.
inline RefinementConfig exact_config() {
  RefinementConfig config;
  config.merge.landmarks_per_keyframe = 0;
  config.merge.odometry_sigma_m = 0.0;
  config.merge.odometry_sigma_deg = 0.0;
  config.merge.max_reprojection_px = 40.0;
  config.bundle.view_loss = {};
  config.bundle.odometry_loss.scale = 1e3;
  config.bundle.odometry_scale_sigma = 1e-6;
  config.bundle.relative_cost_tolerance = 1e-9;
  return config;
}

/// Root mean square of the position errors, m, once the first keyframe is put where it truly is.
inline double position_rmse(const std::vector<BundleKeyframe>& keyframes, const std::vector<Pose3>& truth) {
  const Pose3 T_truth_world = truth.front() * keyframes.front().T_world_body.inverse();
  double sum = 0.0;
  for (const auto& keyframe : keyframes)
    sum += ((T_truth_world * keyframe.T_world_body).translation - truth[keyframe.id.index].translation).squaredNorm();
  return std::sqrt(sum / static_cast<double>(keyframes.size()));
}

}  // namespace tutti::bundle
