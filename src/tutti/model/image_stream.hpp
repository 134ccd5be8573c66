// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/model/image.hpp"
#include "tutti/model/visual.hpp"

namespace tutti {

/// A sensor that measures depth along a camera's optical axis at the camera's pixels (an RGB-D camera with registered
/// depth). The standard deviation at depth z is the root of the sum of squares of `sigma_m` and `sigma_per_m2` z^2.
struct DepthSensor {
  double unit_m = 0.001;               ///< Metres per unit of a DepthImage.
  double sigma_m = 0.0;                ///< Part of the standard deviation that does not depend on depth.
  double sigma_per_m2 = 0.0014;        ///< Part that grows with the square of the depth, at 1 m (a Kinect's value).
  double least_m = 0.3, most_m = 8.0;  ///< Depths outside this range are ignored.
  friend bool operator==(const DepthSensor&, const DepthSensor&) = default;
};

/// The images of one robot, loaded on demand from files or rendered by a simulated camera. All its cameras are exposed
/// at the same times.
struct ImageStream {
  std::vector<Camera> cameras;
  std::vector<Timestamp> stamps;  ///< Strictly increasing.
  /// Loads the image of one camera at `stamps[instant]`; an empty image when the camera took none. Calls may be in any
  /// order.
  std::function<Result<Image>(std::size_t instant, std::size_t camera)> load;
  /// Loads the depth image aligned with the first camera's image; an empty one when there was none. Not set: no depth.
  std::function<Result<DepthImage>(std::size_t instant)> load_depth = {};
  DepthSensor depth = {};
};

}  // namespace tutti
