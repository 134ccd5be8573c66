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

/// What a range sensor saw in one sweep; points in the body frame at `stamp`. Clouds are large and immutable, so
/// shared.
struct Scan {
  Timestamp stamp;
  std::shared_ptr<const PointCloud> cloud;
};

}  // namespace tutti
