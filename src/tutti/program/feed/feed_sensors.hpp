// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::program {

/// What a client of a live feed says that it has beside odometry.
struct FeedSensors {
  bool scans = false;
  std::vector<Camera> cameras;
  std::optional<DepthSensor> depth;  ///< Beside the images of one camera.
  std::optional<ImuNoise> imu;
  friend bool operator==(const FeedSensors&, const FeedSensors&) = default;
};

/// One or two cameras or none, with depth one; each sound and of a size that a message holds; noise that is finite.
Status check_sensors(const FeedSensors& sensors);

/// An image as it came: a PNG or JPEG file, or pixels row by row (grey: a byte each, depth: two, little endian).
struct EncodedImage {
  std::uint32_t camera = 0;
  bool is_raw = false;
  std::string bytes;
};

/// The images of all cameras at one moment.
struct FedImages {
  Timestamp stamp;
  std::vector<EncodedImage> images;
  std::optional<EncodedImage> depth;
  std::shared_ptr<const FeedSensors> sensors = nullptr;  ///< By which they were taken.
};

/// They are of cameras that there are, each of one at most, and raw ones have the bytes of their camera's pixels.
Status check_images(const FedImages& images, const FeedSensors& sensors);

std::size_t bytes_of(const FedImages& images);

}  // namespace tutti::program
