// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "tutti/bags/depth.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/camera.hpp"

namespace tutti::bags {

/// A topic of images, by what has been seen of it.
struct ImageTopic {
  std::string topic;
  bool is_compressed = false;
  std::optional<ImageLayout> first = {};   ///< What its first message shows.
  std::optional<RosCameraInfo> info = {};  ///< The first one beside it (camera_info_topic()).

  [[nodiscard]] bool shows_depth() const;
  /// What a camera sees, in an encoding that to_image() takes, or in a file.
  [[nodiscard]] bool shows_picture() const;
  /// Fails, naming topic and encoding, unless it shows pictures.
  [[nodiscard]] Status check_picture() const;
  /// The camera of its pictures; fails, naming the topic, unless it shows some and is calibrated beside them.
  [[nodiscard]] Result<CameraModel> camera() const;
  /// The size in the first message, which there must be, or of pictures the calibration's, if there is one; 0: of
  /// a file other than PNG.
  [[nodiscard]] std::uint32_t width_px() const;
  [[nodiscard]] std::uint32_t height_px() const;
};

}  // namespace tutti::bags
