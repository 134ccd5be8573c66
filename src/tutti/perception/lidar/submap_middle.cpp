// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/submap_middle.hpp"

#include "tutti/base/check.hpp"

namespace tutti::lidar {
namespace {

Pose3 pose_in_submap(const Submap& submap, std::size_t k) {
  return submap.keyframes.front().T_odom_body.inverse() * submap.keyframes[k].T_odom_body;
}

}  // namespace

Middle find_middle(const Submap& submap) {
  TUTTI_CHECK(submap.odometry.size() + 1 == submap.keyframes.size(), "{} odometry steps between {} keyframes",
              submap.odometry.size(), submap.keyframes.size());
  const std::size_t n = submap.keyframes.size(), m = (n - 1) / 2;
  Middle middle{.index = m, .T_submap_keyframe = pose_in_submap(submap, m)};
  for (std::size_t step = 0; step + 1 < n; ++step) {
    const std::size_t beyond = step < m ? step + 1 : n - 1 - step;
    // The step's error lives in the frame of its end, keyframe step + 1.
    const Matrix6d Ad = adjoint(middle.T_submap_keyframe.inverse() * pose_in_submap(submap, step + 1));
    middle.covariance +=
        static_cast<double>(beyond) / static_cast<double>(n) * Ad * submap.odometry[step].covariance * Ad.transpose();
  }
  return middle;
}

}  // namespace tutti::lidar
