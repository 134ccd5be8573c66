// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/camera.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/image.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::bags {

/// The intrinsics of the unrectified images (K and D; R and P are not read). Models: plumb_bob (4 or 5 numbers),
/// rational_polynomial (8), equidistant or fisheye (4), double_sphere (2); no numbers mean no distortion. Other models
/// and binned images are errors that name what was expected.
Result<CameraModel> to_camera(const RosCameraInfo& message);

/// The image as grey values: mono8 and 8UC1 as they are; rgb8, bgr8, rgba8, bgra8 and 8UC3 by their luminance; in a
/// Bayer pattern of 8 bits each pixel becomes the mean of a square of two by two. Rows may be padded. Other encodings
/// are an error that names them.
Result<Image> to_image(const RosImage& message);
/// True for the encodings that to_image() takes.
bool is_picture(std::string_view encoding);

/// Fails unless the message has as many bytes as its size, its step and so many bytes a pixel want.
Status check_rows(const RosImage& message, std::uint32_t pixel_bytes);

/// The topic of the CameraInfo that belongs to a topic of images: "/a/image_raw" and, compressed,
/// "/a/image_raw/compressed" have "/a/camera_info" beside them.
std::string camera_info_topic(std::string images, bool is_compressed);

/// The sample in a message, in the IMU's own axes; fails unless all its numbers are finite.
Result<ImuSample> to_imu_sample(const RosImu& message);
/// The same sample in the axes of the body, about whose origin it was measured.
ImuSample in_body(const ImuSample& sample, const Pose3& T_body_imu);
/// Fails unless the IMU is in the body's origin within 1 mm: elsewhere it measures other accelerations.
Status check_imu_place(const Pose3& T_body_imu);

}  // namespace tutti::bags
