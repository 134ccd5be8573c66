// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "tutti/base/timestamp.hpp"

namespace tutti {

/// Points in metres, in a frame that the owner of the cloud names.
struct PointCloud {
  std::vector<Eigen::Vector3f> points;
  friend bool operator==(const PointCloud&, const PointCloud&) = default;
};

/// One sweep of a range sensor, which ends at `stamp`. Every point is in the body frame at the time at which it was
/// measured, `age_s` before the stamp; without ages all points are in the body frame at the stamp (undistorted). Clouds
/// are large and immutable, so they are shared.
struct Scan {
  Timestamp stamp;
  std::shared_ptr<const PointCloud> cloud;
  std::shared_ptr<const std::vector<float>> age_s;  ///< Null, or one per point: seconds, not negative.
};

}  // namespace tutti
