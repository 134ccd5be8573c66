// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/image.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/visual.hpp"

/// A depth that is measured at a pixel, as an observation like any other: what a second camera beside the first would
/// see of the point. Its baseline is so wide that the noise of the depth is what this view tells, not that of the
/// pixel.
namespace tutti::visual {

/// The camera of these views: an undistorted pinhole of the first one's focal length, to its right. `sigma_px` is of
/// the first one's keypoints.
Camera depth_camera(const Camera& first, const DepthSensor& sensor, double sigma_px);

/// Is a depth image of the camera's size?
Status check_depth_size(const DepthImage& depth, const Camera& first);

/// Of every keypoint of the first camera where depth is known, its view by depth_camera(), as image 1, with the same
/// track and with the standard deviation that depth and pixel give it. A keypoint without a track gets one from
/// `next_track` on, in `image`, too. None at an edge, where the depths around the pixel disagree: they may be of the
/// thing behind. `depth` is along the optical axis and of the first camera's pixels (check_depth_size()).
TrackedImage view_by_depth(TrackedImage& image, const DepthImage& depth, const DepthSensor& sensor, const Camera& first,
                           const Camera& by_depth, std::uint64_t next_track);

/// Looks at the first depth images of a robot: do they know depths that can be used?
class DepthWatch {
 public:
  static constexpr int kImages = 5;
  static constexpr double kLeastShare = 0.05;  ///< Of the pixels; walls beyond the sensor's range are no fault.
  /// Says so, once, where they do not: all holes, or numbers that are no depths in DepthSensor::unit_m.
  std::optional<std::string> add(const DepthImage& depth, const DepthSensor& sensor);

 private:
  int images_ = 0;
  std::vector<double> depths_m_;
};

}  // namespace tutti::visual
