// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string_view>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/image.hpp"

/// Pictures of sensor_msgs/Image in the encodings that cameras' drivers write.
namespace tutti::bags {

/// The encodings that to_image() takes, for messages.
inline constexpr std::string_view kPictures =
    "mono8, rgb8, bgr8, rgba8, bgra8 or bayer_..8, the same of 16 bits, yuv422 (uyvy), yuyv (yuv422_yuy2) or nv12";

/// The image as grey values: of grey and of YUV (4:2:2, NV12, NV21, NV24) the luma as it is, of colours the luminance;
/// in a Bayer pattern each pixel becomes the mean of a square of two by two. 16 bits become 8 by in_8_bits(). Rows may
/// be padded, 16 bits be in either order. Other encodings are an error that names them.
Result<Image> to_image(const RosImage& message);
/// Bytes of a pixel of an encoding that to_image() takes; 0 of others.
std::uint32_t picture_bytes(std::string_view encoding);

/// Fails unless the message has as many bytes as its size, its step and so many bytes a pixel want.
Status check_rows(const RosImage& message, std::uint32_t pixel_bytes);

}  // namespace tutti::bags
