// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/model/image_stream.hpp"

namespace tutti::intake {

/// Which cameras and which IMU a robot on ROS's topics has.
struct ImagesConfig {
  std::vector<std::string> images;        ///< Topics; empty: found by type, within the namespace.
  std::string depth;                      ///< A topic; empty: found by what messages show, within the namespace.
  bool with_depth = true;                 ///< False: depth is not used.
  std::string imu;                        ///< A topic; empty: found by type, within the namespace.
  std::string within = "/";               ///< How the namespace's topics begin, "/alpha/"; set by resolve().
  int most_cameras = 2;                   ///< RobotConfig::images.most_cameras
  double time_offset_s = 0.0;             ///< Added to the images' stamps gives the odometry's time.
  double most_difference_s = 0.005;       ///< Between the stamps of two cameras' images of one time.
  DepthSensor depth_sensor = {};          ///< Its unit is not read: ROS's depth is in millimetres or metres.
  double most_depth_difference_s = 0.02;  ///< Between the stamps of an image and of its depth.
};

/// The use that a topic of images was configured for.
enum class Wish { nothing, camera, depth };

/// A topic of images, and that of its CameraInfo.
struct CameraTopics {
  std::string images, info;
  bool is_compressed = false;
  bool has_info = true;  ///< The CameraInfo is published.
  Wish wish = Wish::nothing;
  friend bool operator==(const CameraTopics&, const CameraTopics&) = default;
};

}  // namespace tutti::intake
