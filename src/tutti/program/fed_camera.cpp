// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/fed_camera.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "tutti/formats/image_file.hpp"

namespace tutti::program {
namespace {

Result<Image> decoded(const EncodedImage& image, const CameraModel& camera, Timestamp stamp) {
  const std::string name = fmt::format("the image of camera {} at {} ns", image.camera, stamp.ns);
  if (!image.is_raw) return formats::decode_image(image.bytes, name, {camera.width_px, camera.height_px});
  Image out(camera.width_px, camera.height_px);
  std::memcpy(out.grey.data(), image.bytes.data(), std::min(out.grey.size(), image.bytes.size()));
  return out;
}

Result<DepthImage> decoded_depth(const EncodedImage& image, const CameraModel& camera, Timestamp stamp) {
  const std::string name = fmt::format("the depth image at {} ns", stamp.ns);
  if (!image.is_raw) return formats::decode_depth(image.bytes, name, {camera.width_px, camera.height_px});
  DepthImage out{camera.width_px, camera.height_px, {}};
  const auto byte = [&](std::size_t i) {
    return static_cast<std::uint16_t>(static_cast<unsigned char>(image.bytes[i]));
  };
  for (std::size_t i = 0; i + 1 < image.bytes.size(); i += 2)
    out.value.push_back(static_cast<std::uint16_t>(byte(i) | byte(i + 1) << 8U));
  return out;
}

}  // namespace

drive::Driver::Seen FedCamera::see(const EncodedImages& images, bool keyframe) {
  constexpr std::int64_t kNsPerInstant =
      1'000'000;  // numbers that grow across restarts, at up to 1,000 images a second
  const auto instant = static_cast<std::uint64_t>(std::max<std::int64_t>(images.stamp.ns, 0) / kNsPerInstant);
  drive::Driver::Seen out{{.stamp = images.stamp, .cameras = nullptr, .images = {}}, {}};
  if (images.sensors != sensors_) {
    sensors_ = images.sensors;
    auto made = visual::ImageTracker::make(sensors_->cameras, sensors_->depth, config_);
    tracker_ = made ? std::move(*made) : nullptr;
    if (tracker_) tracker_->restart(instant);
    if (!made) out.errors.push_back(made.error());
  }
  if (!tracker_) return out;
  visual::SeenImages seen{.stamp = images.stamp, .instant = instant, .images = {}};
  seen.images.resize(sensors_->cameras.size(), Image());
  for (const EncodedImage& image : images.images)
    seen.images.at(image.camera) = decoded(image, sensors_->cameras[image.camera].model, images.stamp);
  if (images.depth)
    seen.load_depth = [&] { return decoded_depth(*images.depth, sensors_->cameras.front().model, images.stamp); };
  out.images.cameras = tracker_->cameras();
  out.images.images = tracker_->track(seen, keyframe);
  if (sensors_->imu) out.images.imu_noise = *sensors_->imu;
  out.errors = tracker_->take_errors();
  return out;
}

}  // namespace tutti::program
