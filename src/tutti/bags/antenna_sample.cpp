// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/antenna_sample.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "tutti/bags/ros_types.hpp"
#include "tutti/bags/transform_tree.hpp"

namespace tutti::bags {

Result<std::optional<AntennaSample>> to_fix(const RosNavSatFix& message) {
  const bool is_unset = message.latitude_deg == 0.0 && message.longitude_deg == 0.0;
  if (message.status < 0 || is_unset) return std::nullopt;
  PositionFix fix{.stamp = message.header.stamp,
                  .antenna = {message.latitude_deg, message.longitude_deg, message.altitude_m}};
  const Eigen::Matrix3d stated = Eigen::Map<const Eigen::Matrix3d>(message.position_covariance.data());
  const bool has_up = stated(2, 2) > 0.0 || std::isnan(message.altitude_m);
  const bool is_stated = message.position_covariance_type != 0 && stated(0, 0) > 0.0 && stated(1, 1) > 0.0 && has_up;
  if (is_stated) fix.covariance = stated;
  if (std::isnan(message.altitude_m)) {
    fix.antenna.height_m = 0.0;
    fix.covariance.row(2).setZero();
    fix.covariance.col(2).setZero();
    fix.covariance(2, 2) = kUnknownAltitude_m * kUnknownAltitude_m;
  }
  if (auto ok = check_fix(fix.antenna, fix.covariance, fix.p_body_antenna); !ok) return tl::unexpected(ok.error());
  return AntennaSample{fix, frame_name(message.header.frame_id), is_stated, std::isnan(message.altitude_m)};
}

std::string_view ranged_robot(std::string_view topic) {
  constexpr std::string_view kName = "range_to/";
  const std::size_t at = topic.rfind(kName);
  const bool is_whole = at != std::string_view::npos && (at == 0 || topic[at - 1] == '/');
  const std::string_view robot = is_whole ? topic.substr(at + kName.size()) : std::string_view();
  return robot.find('/') == std::string_view::npos ? robot : std::string_view();
}

Result<std::optional<AntennaSample>> to_range(const RosRange& message, std::string_view to) {
  const bool has_limits = message.max_range_m > message.min_range_m;
  if (has_limits && (message.range_m < message.min_range_m || message.range_m > message.max_range_m))
    return std::nullopt;
  RobotRange out{.stamp = message.header.stamp,
                 .to = {},
                 .distance_m = static_cast<double>(message.range_m),
                 .sigma_m = message.variance > 0.0F ? std::sqrt(static_cast<double>(message.variance)) : 0.0,
                 .name = std::string(to)};
  if (auto ok = check_range(out); !ok) return tl::unexpected(ok.error());
  return AntennaSample{.measured = std::move(out), .frame = frame_name(message.header.frame_id)};
}

Result<std::optional<AntennaSample>> read_antenna_sample(std::string_view topic, std::string_view type,
                                                         std::string_view bytes, RosEncoding encoding) {
  if (use_of(type) == Use::fixes) return decode_nav_sat_fix(bytes, encoding).and_then(&to_fix);
  const std::string_view robot = ranged_robot(topic);
  if (robot.empty()) return std::nullopt;
  return decode_range(bytes, encoding).and_then([&](const RosRange& message) { return to_range(message, robot); });
}

std::string place_antenna(AntennaSample& sample, const std::optional<Eigen::Vector3d>& p_body_receiver,
                          const Result<Pose3>& T_body_antenna) {
  const bool is_fix = sample.range() == nullptr;
  Eigen::Vector3d p_body_antenna = Eigen::Vector3d::Zero();
  if (is_fix && p_body_receiver)
    p_body_antenna = *p_body_receiver;
  else if (T_body_antenna)
    p_body_antenna = T_body_antenna->translation;
  else
    return fmt::format("an antenna that is taken to be at the body's origin: {}{}", T_body_antenna.error().message,
                       is_fix ? "; a mission file's robots[].antenna_m may say where it is" : "");
  std::visit([&](auto& of) { of.p_body_antenna = p_body_antenna; }, sample.measured);
  const std::string doubt = doubt_of_place({Eigen::Quaterniond::Identity(), p_body_antenna});
  return fmt::format("an antenna at [{:.2f} {:.2f} {:.2f}] m of the body{}{}", p_body_antenna.x(), p_body_antenna.y(),
                     p_body_antenna.z(), doubt.empty() ? "" : "; the antenna is ", doubt);
}

}  // namespace tutti::bags
