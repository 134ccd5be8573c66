// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_fix.hpp"

#include "tutti/bags/transform_tree.hpp"

namespace tutti::bags {

Result<std::optional<ReceivedFix>> to_fix(const RosNavSatFix& message) {
  if (message.status < 0) return std::nullopt;
  ReceivedFix out{.fix = {.stamp = message.header.stamp,
                          .antenna = {message.latitude_deg, message.longitude_deg, message.altitude_m}},
                  .frame = frame_name(message.header.frame_id)};
  const Eigen::Matrix3d stated = Eigen::Map<const Eigen::Matrix3d>(message.position_covariance.data());
  out.is_stated = message.position_covariance_type != 0 && (stated.diagonal().array() > 0.0).all();
  if (out.is_stated) out.fix.covariance = stated;
  if (auto ok = check_fix(out.fix.antenna, out.fix.covariance, out.fix.p_body_antenna); !ok)
    return tl::unexpected(ok.error());
  return out;
}

}  // namespace tutti::bags
