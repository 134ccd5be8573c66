// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/camera.hpp"
#include "tutti/model/image.hpp"

namespace tutti::bags {

/// Of unrectified images. Models: plumb_bob (4 or 5 numbers), rational_polynomial (8), equidistant or fisheye (4),
/// double_sphere (2); no numbers: no distortion. The error says what it is and what was expected.
Result<CameraModel> to_camera(const RosCameraInfo& message);

/// Grey: mono8, 8UC1, and by their luminance rgb8, bgr8, rgba8, bgra8, 8UC3; of a Bayer pattern each pixel is the mean
/// of the two by two around it. Rows may be padded. Others are an error that names the encoding.
Result<Image> to_image(const RosImage& message);
/// Is it an encoding that to_image() takes?
bool is_picture(std::string_view encoding);

}  // namespace tutti::bags
