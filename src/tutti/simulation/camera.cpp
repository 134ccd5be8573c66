// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/simulation/hall_view.hpp"

namespace tutti::simulation {
namespace {

/// A normal variate from random bits: the sum of eight bytes (central limit theorem), standard deviation 1.
float normal_from(std::uint64_t bits) {
  constexpr float kMean = 8.0F * 127.5F, kSigma = 209.02F;  // sqrt(8 (256^2 - 1) / 12)
  float sum = 0.0F;
  for (int i = 0; i < 8; ++i, bits >>= 8U) sum += static_cast<float>(bits & 0xFFU);
  return (sum - kMean) / kSigma;
}

}  // namespace

CameraModel halved(const CameraModel& camera) {
  CameraModel half = camera;
  half.width_px /= 2;
  half.height_px /= 2;
  half.fx *= 0.5;
  half.fy *= 0.5;
  half.cx = 0.5 * (camera.cx + 0.5) - 0.5;  // The first pixel reaches from -0.5 to 0.5.
  half.cy = 0.5 * (camera.cy + 0.5) - 0.5;
  return half;
}

SimulatedCamera::SimulatedCamera(std::shared_ptr<const HallScene> scene, const CameraModel& model,
                                 const ImageConfig& config)
    : scene_(std::move(scene)), model_(model), config_(config) {
  TUTTI_CHECK(scene_ != nullptr);
  rays_.reserve(static_cast<std::size_t>(model.width_px) * static_cast<std::size_t>(model.height_px));
  for (int y = 0; y < model.height_px; ++y)
    for (int x = 0; x < model.width_px; ++x)
      rays_.push_back(unproject(model, {x, y}).value_or(Eigen::Vector3d::Zero()).cast<float>());
}

Image SimulatedCamera::image(const Pose3& T_world_camera, double time_s, Rng rng) const {
  const Eigen::Vector3f origin = T_world_camera.translation.cast<float>();
  const Eigen::Matrix3f rotation = T_world_camera.rotation.toRotationMatrix().cast<float>();
  const double phase = 2.0 * std::numbers::pi * time_s / config_.exposure_period_s;
  const auto gain = static_cast<float>(255.0 * (1.0 + config_.exposure_swing * std::sin(phase)));
  const auto sigma = static_cast<float>(config_.noise_sigma);
  const auto pixel_rad = static_cast<float>(1.0 / model_.fx);
  const std::uint64_t noise = rng.index(std::uint64_t{1} << 62U);

  Image out(model_.width_px, model_.height_px);
  const std::vector<SeenFace> seen = view_of(scene_->hall, rays_, model_.width_px, T_world_camera);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    float grey = 0.0F;
    if (const auto [distance_m, number] = seen[i]; number != kNoFace) {
      const Face& face = scene_->hall.faces[number];
      const Eigen::Vector3f ray = rotation * rays_[i];
      const float cosine = std::abs(scene_->surface.normal(2 * number).dot(ray));
      const float footprint_m = distance_m * pixel_rad / std::max(std::sqrt(cosine), 0.1F);
      grey = gain * brightness(face, origin + distance_m * ray, footprint_m);
    }
    grey += sigma * normal_from(mixed(noise + i));
    out.grey[i] = static_cast<std::uint8_t>(std::clamp(grey + 0.5F, 0.0F, 255.0F));
  }
  return out;
}

DepthImage SimulatedCamera::depth(const Pose3& T_world_camera, const DepthSensor& sensor, Rng rng) const {
  DepthImage out{model_.width_px, model_.height_px, std::vector<std::uint16_t>(rays_.size())};
  const std::uint64_t noise = rng.index(std::uint64_t{1} << 62U);
  const std::vector<SeenFace> seen = view_of(scene_->hall, rays_, model_.width_px, T_world_camera);
  for (std::size_t i = 0; i < rays_.size(); ++i) {
    if (seen[i].face == kNoFace) continue;
    const double z_m = seen[i].distance_m * rays_[i].z();
    const double sigma_m = std::hypot(sensor.sigma_m, sensor.sigma_per_m2 * z_m * z_m);
    const double measured = (z_m + sigma_m * normal_from(mixed(noise + i))) / sensor.unit_m;
    if (measured < std::numeric_limits<std::uint16_t>::max())
      out.value[i] = static_cast<std::uint16_t>(std::max(measured + 0.5, 0.0));
  }
  return out;
}

ImageStream simulate_images(std::shared_ptr<const HallScene> scene, const std::vector<Camera>& cameras,
                            Trajectory truth, const ImageConfig& config, Rng rng,
                            const std::optional<DepthSensor>& depth) {
  std::vector<SimulatedCamera> simulated;
  for (const Camera& camera : cameras) simulated.emplace_back(scene, camera.model, config);
  ImageStream out{.cameras = cameras, .stamps = {}, .load = {}};
  for (const StampedPose& at : truth) out.stamps.push_back(at.stamp);
  if (depth) {
    out.depth = *depth;
    out.load_depth = [first = simulated.front(), truth, T_body_camera = cameras.front().T_body_camera, sensor = *depth,
                      rng](std::size_t instant) -> Result<DepthImage> {
      return first.depth(truth.at(instant).pose * T_body_camera, sensor, rng.fork("depth").fork(instant));
    };
  }
  out.load = [simulated = std::move(simulated), truth = std::move(truth), cameras, rng](
                 std::size_t instant, std::size_t camera) -> Result<Image> {
    const Pose3 T_world_camera = truth.at(instant).pose * cameras.at(camera).T_body_camera;
    return simulated[camera].image(T_world_camera, truth[instant].stamp - truth.front().stamp,
                                   rng.fork(camera).fork(instant));
  };
  return out;
}

}  // namespace tutti::simulation
