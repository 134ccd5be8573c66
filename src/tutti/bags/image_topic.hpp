// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "tutti/bags/depth.hpp"
#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/geometry/camera.hpp"
#include "tutti/model/image.hpp"

namespace tutti::bags {

/// A message of a topic of images before its image is decoded: a view of its bytes.
using ImageMessage = std::variant<RosImage, RosCompressedImage>;
Result<ImageMessage> decode_image_message(bool is_compressed, std::string_view bytes, RosEncoding encoding);
const RosHeader& header_of(const ImageMessage& message);
/// The picture, grey; of a file as formats::decode_image() has it.
Result<Image> to_image(const ImageMessage& message);
/// The depth image; a file of another size than expected is refused before it is decoded.
Result<DepthImage> to_depth(const ImageMessage& message, formats::ExpectedSize expected);

/// A topic of images, by what has been seen of it.
struct ImageTopic {
  std::string topic;
  bool is_compressed = false;
  std::optional<ImageLayout> first = {};   ///< As the first message that was added shows; before it, the last one.
  std::optional<RosCameraInfo> info = {};  ///< The first one beside it (camera_info_topic()).
  bool is_sure = false;                    ///< A message was added.

  /// Adds its next message. Fails for one of which no image can be made, as far as that is known before decoding it:
  /// with too few bytes, or with depth and another encoding, frame or size than the first that was added.
  Status add(const ImageMessage& message);
  [[nodiscard]] bool shows_depth() const;
  /// Whether it shows what a camera sees, in an encoding that to_image() takes, or in a file.
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
