// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"

/// Decodes messages of ROS 2 as they are in bags and on the wire, CDR of the first version (XCDR1) in either byte
/// order, and messages of ROS 1, which have the same fields, packed, and a sequence number in their header, which is
/// skipped. Fields have the names, units and frames of ROS's own definitions (common_interfaces). Lengths are checked,
/// values are not: quaternions may be no rotations, covariances zero, -1 or nonsense, numbers not finite. Views
/// (std::string_view) point into the bytes that were decoded.
namespace tutti::bags {

enum class RosEncoding { cdr, ros1 };
/// From BagChannel::message_encoding; errors: neither "cdr" nor "ros1".
Result<RosEncoding> to_encoding(std::string_view name);

struct RosHeader {
  Timestamp stamp;
  std::string frame_id;
};

struct RosPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

struct RosOdometry {
  RosHeader header;            ///< `pose` is T_frame_child, frame being header.frame_id;
  std::string child_frame_id;  ///< the twist is in the axes of this frame.
  RosPose pose;
  /// Row by row, translation (m) before rotation (rad), in the axes of header.frame_id.
  std::array<double, 36> pose_covariance{};
  Eigen::Vector3d linear = Eigen::Vector3d::Zero(), angular = Eigen::Vector3d::Zero();  ///< m/s, rad/s
  std::array<double, 36> twist_covariance{};
};

struct RosOccupancyGrid {
  RosHeader header;
  double resolution_m = 0.0;
  std::uint32_t width = 0, height = 0;
  RosPose origin;  ///< Pose of the corner of the first cell.
  std::span<const std::int8_t>
      data;  ///< Row by row; -1 unknown, 0 free to 100 occupied. A decoded one has it in its bytes.
};

struct RosTransform {
  RosHeader header;            ///< The transform is T_parent_child: the parent is header.frame_id,
  std::string child_frame_id;  ///< the child this frame.
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
};

struct RosPointField {
  std::string name;
  std::uint32_t offset = 0;   ///< Bytes within a point.
  std::uint8_t datatype = 0;  ///< 1 to 8: int8, uint8, int16, uint16, int32, uint32, float32, float64.
  std::uint32_t count = 0;
};

struct RosPointCloud {
  RosHeader header;
  std::uint32_t height = 0, width = 0;
  std::vector<RosPointField> fields;
  bool is_bigendian = false;
  std::uint32_t point_step = 0, row_step = 0;  ///< Bytes.
  std::string_view data;                       ///< As long as the message has it, which need not be height * row_step.
  bool is_dense = false;
};

struct RosImu {
  RosHeader header;
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  std::array<double, 9> orientation_covariance{};
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< rad/s
  std::array<double, 9> angular_velocity_covariance{};
  Eigen::Vector3d linear_acceleration = Eigen::Vector3d::Zero();  ///< m/s^2
  std::array<double, 9> linear_acceleration_covariance{};
};

struct RosImage {
  RosHeader header;
  std::uint32_t height = 0, width = 0;
  std::string encoding;  ///< "mono8", "bgr8", "16UC1", ...
  bool is_bigendian = false;
  std::uint32_t step = 0;  ///< Bytes a row.
  std::string_view data;
};

struct RosCompressedImage {
  RosHeader header;
  std::string format;  ///< "jpeg", "png", ...
  std::string_view data;
};

struct RosCameraInfo {
  RosHeader header;
  std::uint32_t height = 0, width = 0;
  std::string distortion_model;
  std::vector<double> d;
  std::array<double, 9> k{}, r{};  ///< Row by row.
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
};

struct RosNavSatFix {
  RosHeader header;
  std::int8_t status = 0;  ///< -1: no fix.
  std::uint16_t service = 0;
  double latitude_deg = 0.0, longitude_deg = 0.0, altitude_m = 0.0;  ///< WGS 84, above the ellipsoid.
  std::array<double, 9> position_covariance{};                       ///< m^2; axes east, north, up; row by row.
  std::uint8_t position_covariance_type = 0;                         ///< 0: unknown.
};

/// The fields that Tutti reads of sensor_msgs/BatteryState; NaN where the robot does not know it.
struct RosBatteryState {
  RosHeader header;
  float voltage_v = 0.0F;
  float percentage = 0.0F;  ///< 0 to 1.
};

/// The fields that Tutti reads of sensor_msgs/Range.
struct RosRange {
  RosHeader header;
  float min_range_m = 0.0F, max_range_m = 0.0F, range_m = 0.0F;
  float variance = 0.0F;  ///< m^2; 0: unknown, as before ROS 2 Jazzy, whose messages do not have it.
};

struct RosPoseStamped {
  RosHeader header;
  RosPose pose;
};

struct RosPoseWithCovariance {
  RosHeader header;
  RosPose pose;
  std::array<double, 36> covariance{};  ///< As RosOdometry::pose_covariance.
};

/// Each takes all bytes of one message, for CDR with the 4-byte encapsulation header. Errors name type, byte (counted
/// behind that header) and what was expected. Bytes may not be left over, except for up to three of padding in CDR.
Result<RosOccupancyGrid> decode_occupancy_grid(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosOdometry> decode_odometry(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<std::vector<RosTransform>> decode_tf(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosPointCloud> decode_point_cloud(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosImu> decode_imu(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosImage> decode_image(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosCompressedImage> decode_compressed_image(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosCameraInfo> decode_camera_info(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosNavSatFix> decode_nav_sat_fix(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosRange> decode_range(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
Result<RosBatteryState> decode_battery_state(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
/// Decodes geometry_msgs/msg/PoseWithCovarianceStamped.
Result<RosPoseWithCovariance> decode_pose_with_covariance(std::string_view bytes,
                                                          RosEncoding encoding = RosEncoding::cdr);
Result<RosPoseStamped> decode_pose_stamped(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);
/// Decodes CustomMsg of livox_ros_driver2, livox_ros_driver or livox_interfaces (livox_ros2_driver) as the cloud that
/// it is: points with the fields `offset_time` (uint32, ns after header.stamp), x, y and z (float32, m). `timebase` is
/// not read, as the driver writes the same time into header.stamp.
Result<RosPointCloud> decode_livox(std::string_view bytes, RosEncoding encoding = RosEncoding::cdr);

/// The types of messages that contain the scan of a LiDAR.
struct ScanType {
  std::string_view name;
  Result<RosPointCloud> (*decode)(std::string_view bytes, RosEncoding encoding);
};
inline constexpr std::array<ScanType, 4> kScanTypes{{{"sensor_msgs/msg/PointCloud2", decode_point_cloud},
                                                     {"livox_ros_driver2/msg/CustomMsg", decode_livox},
                                                     {"livox_ros_driver/msg/CustomMsg", decode_livox},
                                                     {"livox_interfaces/msg/CustomMsg", decode_livox}}};
[[nodiscard]] bool is_scan_type(std::string_view type);
/// Decodes a message of one of kScanTypes; errors: another type.
Result<RosPointCloud> decode_scan(std::string_view type, std::string_view bytes,
                                  RosEncoding encoding = RosEncoding::cdr);

}  // namespace tutti::bags
