// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>

#include "tutti/model/submap.hpp"

namespace tutti::visual {

/// Reprojection errors of landmarks.
struct ReprojectionError {
  double sum_px2 = 0.0;   ///< Sum of squared errors.
  std::size_t views = 0;  ///< Views counted; those that no pixel sees from the pose (project()) are left out.
  [[nodiscard]] double rms_px() const { return views > 0 ? std::sqrt(sum_px2 / static_cast<double>(views)) : 0.0; }
};

/// Errors of a submap's landmarks in its own images, at the poses of its own odometry; zero without images. The
/// payload's indices must be valid, as wire::decode_submap() checks.
ReprojectionError reprojection_error(const Submap& submap);

}  // namespace tutti::visual
