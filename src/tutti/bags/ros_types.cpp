// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_types.hpp"

#include <algorithm>

namespace tutti::bags {
namespace {

template <auto kDecode>
Result<RosMessage> decoded(std::string_view bytes, RosEncoding encoding) {
  auto message = kDecode(bytes, encoding);
  if (!message) return tl::unexpected(message.error());
  return RosMessage(std::move(*message));
}

constexpr RosType kRosTypes[] = {
    {kOdometryType, Use::odometry, decoded<decode_odometry>},
    {kPoseType, Use::poses, decoded<decode_pose_stamped>},
    {kTfType, Use::transforms, decoded<decode_tf>},
    {kImageType, Use::images, decoded<decode_image>},
    {kCompressedType, Use::images, decoded<decode_compressed_image>},
    {kCameraInfoType, Use::calibration, decoded<decode_camera_info>},
    {kImuType, Use::imu, decoded<decode_imu>},
    {kFixType, Use::fixes, decoded<decode_nav_sat_fix>},
    {kBatteryType, Use::battery, decoded<decode_battery_state>},
    {kRangeType, Use::ranges, decoded<decode_range>},
    {kScanTypes[0].name, Use::scans, decoded<kScanTypes[0].decode>},
    {kScanTypes[1].name, Use::scans, decoded<kScanTypes[1].decode>},
    {kScanTypes[2].name, Use::scans, decoded<kScanTypes[2].decode>},
    {kScanTypes[3].name, Use::scans, decoded<kScanTypes[3].decode>},
};
static_assert(kScanTypes.size() == 4, "all of them are in the table");

const RosType* find(std::string_view type) {
  const auto* const at = std::ranges::find(kRosTypes, type, &RosType::name);
  return at == std::ranges::end(kRosTypes) ? nullptr : at;
}

}  // namespace

std::span<const RosType> ros_types() { return kRosTypes; }

std::string type_of_ros2(const std::string& type) {
  if (type == "tf/tfMessage" || type == "tf/msg/tfMessage") return kTfType;
  const std::size_t slash = type.find('/');
  if (slash == std::string::npos || slash != type.rfind('/')) return type;
  return type.substr(0, slash) + "/msg" + type.substr(slash);
}

std::string type_of_ros1(std::string_view type) {
  std::string out(type);
  if (const std::size_t at = out.find("/msg/"); at != std::string::npos) out.erase(at, 4);
  return out;
}

Use use_of(std::string_view type) {
  const RosType* const found = find(type);
  return found == nullptr ? Use::nothing : found->use;
}

Result<RosMessage> decode_message(std::string_view type, std::string_view bytes, RosEncoding encoding) {
  if (const RosType* const found = find(type)) return found->decode(bytes, encoding);
  return fail(ErrorCode::unsupported, "type '{:.200}', which is not decoded", type);
}

}  // namespace tutti::bags
