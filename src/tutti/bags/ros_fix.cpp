// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_fix.hpp"

#include <cmath>

#include "tutti/bags/transform_tree.hpp"

namespace tutti::bags {

Result<std::optional<ReceivedFix>> to_fix(const RosNavSatFix& message) {
  const bool is_unset = message.latitude_deg == 0.0 && message.longitude_deg == 0.0;
  if (message.status < 0 || is_unset) return std::nullopt;
  ReceivedFix out{.fix = {.stamp = message.header.stamp,
                          .antenna = {message.latitude_deg, message.longitude_deg, message.altitude_m}},
                  .frame = frame_name(message.header.frame_id)};
  const Eigen::Matrix3d stated = Eigen::Map<const Eigen::Matrix3d>(message.position_covariance.data());
  const bool has_up = stated(2, 2) > 0.0 || std::isnan(message.altitude_m);
  out.is_stated = message.position_covariance_type != 0 && stated(0, 0) > 0.0 && stated(1, 1) > 0.0 && has_up;
  if (out.is_stated) out.fix.covariance = stated;
  if (std::isnan(message.altitude_m)) {
    out.is_flat = true;
    out.fix.antenna.height_m = 0.0;
    out.fix.covariance.row(2).setZero();
    out.fix.covariance.col(2).setZero();
    out.fix.covariance(2, 2) = kUnknownAltitude_m * kUnknownAltitude_m;
  }
  if (auto ok = check_fix(out.fix.antenna, out.fix.covariance, out.fix.p_body_antenna); !ok)
    return tl::unexpected(ok.error());
  return out;
}

}  // namespace tutti::bags
