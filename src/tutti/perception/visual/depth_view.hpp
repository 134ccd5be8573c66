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

/// Turns a depth that is measured at a pixel into an observation like any other: what a virtual second camera beside
/// the first one would see of the point. The baseline is wide enough that the view's uncertainty is that of the depth,
/// not of the pixel.
namespace tutti::visual {

/// The virtual camera: an undistorted pinhole with the first camera's focal length, to its right. `sigma_px`: standard
/// deviation of the first camera's keypoints.
Camera depth_camera(const Camera& first, const DepthSensor& sensor, double sigma_px);

/// Accepts a depth image of the camera's size; else ErrorCode::invalid.
Status check_depth_size(const DepthImage& depth, const Camera& first);

/// The image of camera 1, `by_depth` (made by depth_camera()), of the keypoints in `image` where depth is known: each
/// with the same track and the standard deviation that depth and pixel give it. A keypoint without a track gets one,
/// from `next_track` on, in both images. Keypoints at edges, where the depths around the pixel disagree, are left out,
/// because their depth may be that of the background. `depth` is along the optical axis, for the first camera's pixels
/// (check_depth_size()).
TrackedImage view_by_depth(TrackedImage& image, const DepthImage& depth, const DepthSensor& sensor, const Camera& first,
                           const Camera& by_depth, std::uint64_t next_track);

/// Checks that a robot's first depth images have usable depths.
class DepthWatch {
 public:
  static constexpr int kImages = 5;
  /// Share of the pixels that must have one; walls beyond the sensor's range are no fault.
  static constexpr double kLeastShare = 0.05;
  /// The problem, reported once, after kImages images: nearly all pixels are without depth, or the numbers are no
  /// depths in units of DepthSensor::unit_m. Otherwise no value.
  std::optional<std::string> add(const DepthImage& depth, const DepthSensor& sensor);

 private:
  int images_ = 0;
  std::vector<double> depths_m_;
};

}  // namespace tutti::visual
