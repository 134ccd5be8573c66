// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "tutti/base/timestamp.hpp"

namespace tutti {

/// Points in metres, in the frame its owner names.
struct PointCloud {
  std::vector<Eigen::Vector3f> points;
  friend bool operator==(const PointCloud&, const PointCloud&) = default;
};

/// What a range sensor saw in one sweep that ends at `stamp`. Every point is in the body frame of the moment it was
/// measured, `age_s` before the stamp; without ages all were measured (or undistorted to be) at the stamp. Clouds are
/// large and immutable, so shared.
struct Scan {
  Timestamp stamp;
  std::shared_ptr<const PointCloud> cloud;
  std::shared_ptr<const std::vector<float>> age_s;  ///< Null, or one per point, seconds, not negative.
};

}  // namespace tutti
