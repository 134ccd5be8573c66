// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/visual.hpp"

namespace tutti {

/// Limit on the pixels of an image: a raw one must fit a message of the live feed.
inline constexpr std::size_t kMaxPixels = 16U << 20U;
inline constexpr std::size_t kMaxImuSamples = 10'000;  ///< Limit per message: ten seconds at 1 kHz.

/// The sensors that a robot has beside odometry, as who feeds it says.
struct Sensors {
  bool scans = false;
  std::vector<Camera> cameras;
  std::optional<DepthSensor> depth;  ///< Aligned with the images of a single camera.
  std::optional<ImuNoise> imu;
  friend bool operator==(const Sensors&, const Sensors&) = default;
};

/// Fails unless there are at most two cameras (one where there is depth), each valid and small enough for a message,
/// and the IMU's noise is finite.
Status check_sensors(const Sensors& sensors);

/// An image as it was sent: a PNG or JPEG file, or raw pixels row by row (grey: one byte each; depth: two, little
/// endian).
struct EncodedImage {
  std::uint32_t camera = 0;
  bool is_raw = false;
  std::string bytes;
};

/// The images of all cameras at one time.
struct EncodedImages {
  Timestamp stamp;
  std::vector<EncodedImage> images;
  std::optional<EncodedImage> depth;
  std::shared_ptr<const Sensors> sensors = nullptr;  ///< The sensors that took them.
};

/// Fails unless every image is of a known camera, each camera has at most one, and raw images have the size of their
/// camera's.
Status check_images(const EncodedImages& images, const Sensors& sensors);

std::size_t bytes_of(const EncodedImages& images);

}  // namespace tutti
