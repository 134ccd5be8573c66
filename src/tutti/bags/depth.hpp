// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/formats/image_file.hpp"
#include "tutti/model/image.hpp"

/// Depth images of ROS (REP 118), and how to distinguish them from a camera's.
namespace tutti::bags {

inline constexpr double kDepthUnit_m = 0.001;  ///< Unit of what to_depth() returns.

/// The layout of a message's image, known before it is decoded.
struct ImageLayout {
  std::string encoding, frame;
  std::uint32_t width_px = 0, height_px = 0;  ///< 0: of a file other than PNG.
};
ImageLayout layout_of(const RosImage& message);
/// The encoding is the first word of the format ("16UC1; compressedDepth png"); a grey PNG image of 16 bits whose
/// format names none is 16UC1.
ImageLayout layout_of(const RosCompressedImage& message);

/// True for images that show depth, by their encoding: 16UC1, 32FC1, and mono16 where the topic's name has "depth" in
/// it. Images of the transport compressedDepth (topic/compressedDepth) show nothing else.
bool is_depth(std::string_view topic, std::string_view encoding);

/// Bytes of a pixel of such an encoding.
std::uint32_t depth_bytes(std::string_view encoding);

/// Fails unless a message has the encoding, frame and size of the `first` one of its topic.
Status check_like_first(const ImageLayout& layout, const ImageLayout& first);

/// The depth image in millimetres: of 16UC1 and mono16, which have these, of 32FC1, which has metres. Depths that are
/// not finite, not positive, or beyond 65.5 m are unknown. Rows may be padded, bytes in either order. Other encodings
/// are an error.
Result<DepthImage> to_depth(const RosImage& message);
/// The same of a compressed message: a grey PNG image of 16 bits, behind the 12 bytes that compressedDepth puts before
/// it, or without these; of 32FC1 it has the inverse depth, by the two numbers there. Another size than expected is
/// refused before it is decoded.
Result<DepthImage> to_depth(const RosCompressedImage& message, formats::ExpectedSize expected);
/// The PNG image in a compressed message's bytes; empty when there is none.
std::string_view png_of(std::string_view data);

}  // namespace tutti::bags
