// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/localise/shut_in.hpp"

namespace tutti::localise {

void ShutIn::see(const PointCloud& cloud, double min_range_m, const StampedPose& T_odom_body) {
  std::size_t seen = 0, beyond = 0;
  for (const Eigen::Vector3f& point : cloud.points) {
    const double range_m = point.norm();
    if (range_m < min_range_m) continue;
    ++seen;
    if (range_m > kReach_m) ++beyond;
  }
  if (seen == 0) return;
  if (static_cast<double>(beyond) > kMostBeyond * static_cast<double>(seen)) {
    since_.reset();
    is_ = false;
    return;
  }
  const bool has_moved = since_ && (since_->pose.translation - T_odom_body.pose.translation).norm() > kStands_m;
  if (!since_ || (has_moved && !is_)) since_ = T_odom_body;
  is_ = is_ || T_odom_body.stamp - since_->stamp >= kFor_s;
}

}  // namespace tutti::localise
