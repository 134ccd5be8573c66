// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tutti/bags/image_topic.hpp"
#include "tutti/base/result.hpp"
#include "tutti/geometry/pose3.hpp"

/// Which of a robot's topics of images are its camera, its two cameras, or its camera with depth: one rule for bags and
/// for what is live.
namespace tutti::bags {

/// T_a_b of two frames that do not move against each other, by what is known of transforms.
using FindTransform = std::function<std::optional<Pose3>(const std::string& a, const std::string& b)>;

/// Fails unless the pixels of `depth` are those of `camera`: its images have the same size; its CameraInfo, where there
/// is one, has the same matrix, each of fx, fy, cx and cy within 1 px; and its frame is the camera's, or one at the
/// same place by the transforms, within 1 mm and 1 mrad. The error names value and expected value.
Status check_registered(const ImageTopic& depth, const ImageTopic& camera, const FindTransform& find);

/// The topics to use as configured, and how to configure them.
struct CameraWishes {
  bool are_named = false;   ///< The cameras; otherwise they were found by type.
  int most_cameras = 2;     ///< 1: of two cameras only the first is used.
  std::string images_flag;  ///< Put before a camera's topic to choose it, such as "--images ".
  std::string depth_flag;   ///< The same of a topic of depth.
};

struct CameraChoice {
  std::vector<std::size_t> cameras;  ///< One or two of those that were given; none when there are none.
  std::optional<std::size_t> depth;  ///< Registered to the one camera.
  std::string note;                  ///< Why no depth is used although there is some; else empty.
};

/// Uses one or two cameras; of all topics a first message has been seen. A topic that is there raw and compressed
/// counts once; two topics that one CameraInfo calibrates are an error. Where they were not named and a topic of depth
/// is registered to one of them alone, this one is used, with its depth; where to several, or where there are more than
/// two cameras, the error lists them and the flag that decides. Depth is used with one camera, if exactly one topic is
/// registered to it.
Result<CameraChoice> choose_cameras(std::span<const ImageTopic> cameras, std::span<const ImageTopic> depths,
                                    const CameraWishes& wishes, const FindTransform& find);

}  // namespace tutti::bags
