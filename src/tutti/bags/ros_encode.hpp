// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tutti/bags/ros_messages.hpp"

/// The other way round of ros_messages.hpp: CDR (XCDR1), little endian, with its 4-byte header. What is decoded and
/// encoded again has the same bytes, but for what decoders pass over (CameraInfo's region of interest, padding).
namespace tutti::bags {

std::string encode(const RosOdometry& message);
std::string encode(std::span<const RosTransform> message);
std::string encode(const RosPointCloud& message);
std::string encode(const RosImu& message);
std::string encode(const RosImage& message);
std::string encode(const RosCompressedImage& message);
std::string encode(const RosCameraInfo& message);
std::string encode(const RosNavSatFix& message);
std::string encode(const RosPoseStamped& message);

/// Written alone: what viewers show.
struct RosPath {
  RosHeader header;
  std::vector<RosPoseStamped> poses;
};
std::string encode(const RosPath& message);

/// Of visualization_msgs/msg/Marker, the kind that draws a line between every two points.
struct RosLines {
  RosHeader header;
  std::string name_space;
  std::int32_t id = 0;
  double width_m = 0.0;
  std::array<float, 4> rgba{1.0F, 1.0F, 1.0F, 1.0F};
  std::vector<Eigen::Vector3d> points;
};
/// As visualization_msgs/msg/MarkerArray.
std::string encode(std::span<const RosLines> message);

/// Of diagnostic_msgs/msg/DiagnosticStatus.
struct RosDiagnostic {
  std::uint8_t level = 0;  ///< 0 fine, 1 a warning, 2 an error, 3 stale.
  std::string name, message, hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};
/// As diagnostic_msgs/msg/DiagnosticArray.
std::string encode(const RosHeader& header, std::span<const RosDiagnostic> message);

}  // namespace tutti::bags
