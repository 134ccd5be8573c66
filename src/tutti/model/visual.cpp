// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/visual.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace tutti {
namespace {

Status check_image(const TrackedImage& image) {
  if (image.descriptors.size() != 0 && image.descriptors.size() != image.keypoints.size())
    return fail(ErrorCode::invalid, "{} descriptors for {} keypoints", image.descriptors.size(),
                image.keypoints.size());
  std::set<std::uint64_t> tracks;
  for (const TrackedKeypoint& keypoint : image.keypoints) {
    if (!keypoint.pixel.allFinite() || !(keypoint.sigma_px > 0.0F) || !std::isfinite(keypoint.sigma_px))
      return fail(ErrorCode::invalid, "a keypoint at ({}, {}) with a sigma of {} px, expected finite and positive",
                  keypoint.pixel.x(), keypoint.pixel.y(), keypoint.sigma_px);
    if (keypoint.track != 0 && !tracks.insert(keypoint.track).second)
      return fail(ErrorCode::invalid, "track {} is in one image twice", keypoint.track);
  }
  return {};
}

}  // namespace

Status check_images(const TrackedImages& images) {
  if (images.cameras == nullptr || images.cameras->empty()) return fail(ErrorCode::invalid, "no cameras");
  for (const Camera& camera : *images.cameras) {
    if (auto ok = check_camera(camera.model); !ok) return ok;
    if (!is_valid(camera.T_body_camera)) return fail(ErrorCode::invalid, "T_body_camera is not a pose");
  }
  std::set<std::uint32_t> seen;
  for (const TrackedImage& image : images.images) {
    if (image.camera >= images.cameras->size() || !seen.insert(image.camera).second)
      return fail(ErrorCode::invalid, "an image of camera {}, expected one of each of {}", image.camera,
                  images.cameras->size());
    if (auto ok = check_image(image); !ok) return in_context(fmt::format("camera {}", image.camera), ok.error());
  }
  for (std::size_t i = 0; i < images.imu.size(); ++i) {
    const ImuSample& sample = images.imu[i];
    if (!sample.gyro.allFinite() || !sample.accelerometer.allFinite() ||
        (i > 0 && sample.stamp <= images.imu[i - 1].stamp))
      return fail(ErrorCode::invalid, "IMU sample at {} ns: expected finite numbers and increasing stamps",
                  sample.stamp.ns);
  }
  return {};
}

}  // namespace tutti
