// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/sensors.hpp"

#include <fmt/format.h>

#include <cmath>
#include <set>

namespace tutti {
namespace {

std::size_t pixels_of(const Camera& camera) {
  return static_cast<std::size_t>(camera.model.width_px) * static_cast<std::size_t>(camera.model.height_px);
}

Status check_image(const EncodedImage& image, const Camera& camera, std::size_t bytes_per_pixel, const char* what) {
  const std::size_t expected = bytes_per_pixel * pixels_of(camera);
  if (image.is_raw && image.bytes.size() != expected)
    return fail(ErrorCode::invalid, "{} of {} bytes, expected {} of {} x {} pixels", what, image.bytes.size(), expected,
                camera.model.width_px, camera.model.height_px);
  if (image.bytes.empty()) return fail(ErrorCode::invalid, "{} of no bytes", what);
  return {};
}

bool is_noise(double density) { return std::isfinite(density) && density > 0.0; }

}  // namespace

Status check_sensors(const Sensors& sensors) {
  if (sensors.cameras.size() > 2)
    return fail(ErrorCode::unsupported, "{} cameras, expected one or two", sensors.cameras.size());
  if (sensors.depth && sensors.cameras.size() != 1)
    return fail(ErrorCode::unsupported, "{} cameras with depth, expected one", sensors.cameras.size());
  for (std::size_t i = 0; i < sensors.cameras.size(); ++i) {
    const Camera& camera = sensors.cameras[i];
    if (auto ok = check_camera(camera.model); !ok) return in_context(fmt::format("camera {}", i), ok.error());
    if (static_cast<std::size_t>(camera.model.width_px) > kMaxPixels / static_cast<std::size_t>(camera.model.height_px))
      return fail(ErrorCode::unsupported, "camera {}: {} x {} pixels, expected at most {}", i, camera.model.width_px,
                  camera.model.height_px, kMaxPixels);
    const Pose3& pose = camera.T_body_camera;
    if (!pose.translation.allFinite() || !(std::abs(pose.rotation.norm() - 1.0) < 1e-6))
      return fail(ErrorCode::invalid, "camera {}: T_body_camera is no pose: its quaternion has norm {}", i,
                  pose.rotation.norm());
  }
  if (sensors.depth) {
    const DepthSensor& depth = *sensors.depth;
    const bool is_sound = is_noise(depth.unit_m) && std::isfinite(depth.sigma_m) && depth.sigma_m >= 0.0 &&
                          std::isfinite(depth.sigma_per_m2) && depth.sigma_per_m2 >= 0.0 && depth.least_m > 0.0 &&
                          std::isfinite(depth.most_m) && depth.least_m < depth.most_m;
    if (!is_sound)
      return fail(
          ErrorCode::invalid,
          "depth: unit_m {}, sigma_m {}, sigma_per_m2 {}, {} to {} m: expected positive ones, the nearest before "
          "the farthest",
          depth.unit_m, depth.sigma_m, depth.sigma_per_m2, depth.least_m, depth.most_m);
  }
  if (!sensors.imu) return {};
  const auto& [gyro, gyro_walk, accelerometer, accelerometer_walk] = *sensors.imu;
  if (!is_noise(gyro) || !is_noise(gyro_walk) || !is_noise(accelerometer) || !is_noise(accelerometer_walk))
    return fail(ErrorCode::invalid, "imu: noise densities {}, {}, {}, {}: expected positive ones", gyro, gyro_walk,
                accelerometer, accelerometer_walk);
  return {};
}

Status check_images(const EncodedImages& images, const Sensors& sensors) {
  if (sensors.cameras.empty())
    return fail(ErrorCode::unsupported, "images at {} ns: no camera is set up: Hello has none (Sensors.camera)",
                images.stamp.ns);
  const auto where = [&] { return fmt::format("images at {} ns", images.stamp.ns); };
  std::set<std::uint32_t> seen;
  for (const EncodedImage& image : images.images) {
    if (image.camera >= sensors.cameras.size() || !seen.insert(image.camera).second)
      return fail(ErrorCode::invalid, "{}: one of camera {}, expected at most one of each of {}", where(), image.camera,
                  sensors.cameras.size());
    if (auto ok = check_image(image, sensors.cameras[image.camera], 1, "an image"); !ok)
      return in_context(where(), ok.error());
  }
  if (!seen.contains(0)) return fail(ErrorCode::invalid, "{}: none of camera 0, which the others follow", where());
  if (!images.depth) return {};
  if (!sensors.depth) return fail(ErrorCode::unsupported, "{}: depth, which Hello does not announce", where());
  if (auto ok = check_image(*images.depth, sensors.cameras.front(), 2, "a depth image"); !ok)
    return in_context(where(), ok.error());
  return {};
}

std::size_t bytes_of(const EncodedImages& images) {
  std::size_t out = images.depth ? images.depth->bytes.size() : 0;
  for (const EncodedImage& image : images.images) out += image.bytes.size();
  return out;
}

}  // namespace tutti
