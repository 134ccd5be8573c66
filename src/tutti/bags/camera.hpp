// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "tutti/bags/ros_messages.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/camera.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/model/visual.hpp"

namespace tutti::bags {

/// The intrinsics of the unrectified images (K and D; R and P are not read). Models: plumb_bob (4 or 5 numbers),
/// rational_polynomial (8), equidistant or fisheye (4), double_sphere (2); no numbers mean no distortion. Other models
/// and binned images are errors that name what was expected.
Result<CameraModel> to_camera(const RosCameraInfo& message);

/// The topic of the CameraInfo that belongs to a topic of images: "/a/image_raw" and, compressed,
/// "/a/image_raw/compressed" have "/a/camera_info" beside them.
std::string camera_info_topic(std::string images, bool is_compressed);

/// The sample in a message, in the IMU's own axes; fails unless all its numbers are finite.
Result<ImuSample> to_imu_sample(const RosImu& message);
/// The same sample in the axes of the body, about whose origin it was measured.
ImuSample in_body(const ImuSample& sample, const Pose3& T_body_imu);
/// Fails unless the IMU is in the body's origin within 1 mm: elsewhere it measures other accelerations.
Result<Pose3> check_imu_place(const Pose3& T_body_imu);

}  // namespace tutti::bags
