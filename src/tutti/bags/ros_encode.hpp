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
#include "tutti/geometry/geodesy.hpp"
#include "tutti/geometry/pose3.hpp"

/// Encodes ROS 2 messages, the inverse of ros_messages.hpp: CDR (XCDR1), little endian, with its 4-byte header. A
/// message that is decoded and encoded again has the same bytes, except for parts that decoders skip (CameraInfo's
/// region of interest, padding).
namespace tutti::bags {

std::string encode(const RosOdometry& message);
std::string encode(std::span<const RosTransform> message);
std::string encode(const RosPointCloud& message);
std::string encode(const RosImu& message);
std::string encode(const RosImage& message);
std::string encode(const RosCompressedImage& message);
std::string encode(const RosCameraInfo& message);
std::string encode(const RosNavSatFix& message);
std::string encode(const RosRange& message);
std::string encode(const RosPoseStamped& message);
std::string encode(const RosOccupancyGrid& message);

RosPose to_ros(const Pose3& T_frame_body);
/// A fix of unknown covariance.
RosNavSatFix to_ros(const RosHeader& header, const Geodetic& place);
/// The matrix row by row.
std::array<double, 36> to_ros(const Matrix6d& matrix);
/// From the covariance of T_frame_body's right perturbation [m; rad], which is in the body's axes, to ROS's covariance
/// of a pose: of a shift along, and a turn about, the axes of the frame.
std::array<double, 36> pose_covariance(const Matrix6d& covariance, const Eigen::Quaterniond& R_frame_body);
/// The other way round.
Matrix6d covariance_of(const Matrix6d& pose_covariance, const Eigen::Quaterniond& R_frame_body);

/// As geometry_msgs/msg/PoseWithCovarianceStamped.
std::string encode(const RosPoseWithCovariance& message);

// The types that follow are written only, not read: they are for viewers and planners.

/// rosgraph_msgs/msg/Clock
std::string encode_clock(Timestamp now);

struct RosPath {
  RosHeader header;
  std::vector<RosPoseStamped> poses;
};
std::string encode(const RosPath& message);

/// A visualization_msgs/msg/Marker that draws a line between the points 2k and 2k + 1.
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

/// A ball with a name above it, drawn by markers.
struct RosBall {
  RosHeader header;
  std::string name_space, name;
  RosPose pose;
  double diameter_m = 0.5;
  std::array<float, 4> rgba{1.0F, 1.0F, 1.0F, 1.0F};
};
/// A visualization_msgs/msg/MarkerArray that replaces all markers shown on its topic before.
std::string encode(const RosHeader& header, std::span<const RosBall> message);

/// A diagnostic_msgs/msg/DiagnosticStatus.
struct RosDiagnostic {
  std::uint8_t level = 0;  ///< 0 OK, 1 warning, 2 error, 3 stale.
  std::string name, message, hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};
/// As diagnostic_msgs/msg/DiagnosticArray.
std::string encode(const RosHeader& header, std::span<const RosDiagnostic> message);

}  // namespace tutti::bags
