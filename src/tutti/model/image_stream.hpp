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

/// What measures depth along a camera's optical axis, at its pixels (an RGB-D camera whose depth is registered).
struct DepthSensor {
  double unit_m = 0.001;               ///< Of a depth image's numbers.
  double sigma_m = 0.0;                ///< Standard deviation: this, and beside it
  double sigma_per_m2 = 0.0014;        ///< this at 1 m, growing with the square of the depth (a Kinect's).
  double least_m = 0.3, most_m = 8.0;  ///< What is nearer or farther is not believed.
  friend bool operator==(const DepthSensor&, const DepthSensor&) = default;
};

/// The images of a robot: files, or a simulated camera. All its cameras are exposed at the same moments.
struct ImageStream {
  std::vector<Camera> cameras;
  std::vector<Timestamp> stamps;  ///< Strictly increasing.
  /// What a camera saw at a moment (an index into `stamps`); an empty image when it took none. Any order.
  std::function<Result<Image>(std::size_t moment, std::size_t camera)> load;
  /// The depth of what the first camera saw; an empty image when there was none. Not set: there is no depth.
  std::function<Result<DepthImage>(std::size_t moment)> load_depth = {};
  DepthSensor depth = {};
};

}  // namespace tutti
