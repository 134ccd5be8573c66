// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>

#include "tutti/model/submap.hpp"

namespace tutti::visual {

/// How far landmarks are from the pixels that are theirs.
struct ReprojectionError {
  double sum_px2 = 0.0;   ///< Of squared distances.
  std::size_t views = 0;  ///< Those that the camera cannot see where the pose has it are left out.
  [[nodiscard]] double rms_px() const { return views > 0 ? std::sqrt(sum_px2 / static_cast<double>(views)) : 0.0; }
};

/// Of a submap's landmarks in its own images, by its own odometry; zero without images. Indices are valid
/// (check_payload, where it came from outside).
ReprojectionError reprojection_error(const Submap& submap);

}  // namespace tutti::visual
