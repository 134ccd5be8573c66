// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_messages.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cstddef>
#include <ranges>
#include <span>
#include <utility>

#include "tutti/bags/internal/cursor.hpp"

namespace tutti::bags {
namespace {

using internal::Cursor;

constexpr std::size_t kEncapsulationBytes = 4;
constexpr std::size_t kMostPadding = 3;

/// CDR's length counts the NUL behind the text; some writers give an empty string no NUL.
std::string text(Cursor& in, std::string_view what) {
  std::string_view bytes = in.counted(what);
  if (bytes.empty() || in.layout() == Cursor::Layout::packed) return std::string(bytes);
  if (bytes.back() != '\0') in.complain(fmt::format("{} does not end with a NUL", what));
  bytes.remove_suffix(1);
  return std::string(bytes);
}

/// How many elements follow; no memory is taken for more than the bytes that are left can contain.
std::uint32_t sequence(Cursor& in, std::size_t least_bytes, std::string_view what) {
  const auto count = in.number<std::uint32_t>(what);
  if (count <= in.left() / least_bytes) return count;
  in.complain(
      fmt::format("{} has {} elements of {} bytes at least, {} bytes are left", what, count, least_bytes, in.left()));
  return 0;
}

void numbers(Cursor& in, std::span<double> out, std::string_view what) {
  for (double& value : out) value = in.number<double>(what);
}

Eigen::Vector3d vector(Cursor& in, std::string_view what) {
  Eigen::Vector3d out;
  numbers(in, {out.data(), 3}, what);
  return out;
}

/// ROS and Eigen both store x, y, z, w.
Eigen::Quaterniond quaternion(Cursor& in, std::string_view what) {
  Eigen::Quaterniond out;
  numbers(in, {out.coeffs().data(), 4}, what);
  return out;
}

RosHeader header(Cursor& in) {
  constexpr std::int64_t kPerSecond = 1'000'000'000;
  RosHeader out;
  if (in.layout() == Cursor::Layout::packed) in.number<std::uint32_t>("header.seq");
  const auto seconds = in.number<std::int32_t>("header.stamp.sec");
  const auto rest = in.number<std::uint32_t>("header.stamp.nanosec");
  out.stamp.ns = kPerSecond * seconds + rest;
  out.frame_id = text(in, "header.frame_id");
  return out;
}

RosPose pose(Cursor& in) {
  RosPose out;
  out.position = vector(in, "position");
  out.orientation = quaternion(in, "orientation");
  return out;
}

Result<Cursor> cursor_of(std::string_view bytes, RosEncoding encoding, const char* type) {
  if (encoding == RosEncoding::ros1) return Cursor(bytes);
  if (bytes.size() < kEncapsulationBytes)
    return fail(ErrorCode::parse, "{}: {} bytes, expected at least {}", type, bytes.size(), kEncapsulationBytes);
  if (bytes[0] != 0 || (bytes[1] != 0 && bytes[1] != 1))
    return fail(ErrorCode::unsupported, "{}: encapsulation {:02x} {:02x}, expected 00 00 or 00 01 (CDR, XCDR1)", type,
                static_cast<unsigned char>(bytes[0]), static_cast<unsigned char>(bytes[1]));
  return Cursor(bytes.substr(kEncapsulationBytes), bytes[1] == 0 ? Cursor::Order::big : Cursor::Order::little,
                Cursor::Layout::aligned);
}

/// `read(in)` takes the fields one after the other.
template <class Read>
auto decode(std::string_view bytes, RosEncoding encoding, const char* type, const Read& read)
    -> Result<decltype(read(std::declval<Cursor&>()))> {
  auto in = cursor_of(bytes, encoding, type);
  if (!in) return tl::unexpected(in.error());
  auto out = read(*in);
  const std::size_t most = encoding == RosEncoding::cdr ? kMostPadding : 0;
  if (in->ok() && in->left() > most)
    in->complain(fmt::format("{} bytes are left, expected the end: another definition of the type?", in->left()));
  if (!in->ok()) return fail(ErrorCode::parse, "{}: {}", type, *in->error());
  return out;
}

}  // namespace

Result<RosEncoding> to_encoding(std::string_view name) {
  if (name == "cdr") return RosEncoding::cdr;
  if (name == "ros1") return RosEncoding::ros1;
  return fail(ErrorCode::unsupported, "encoding '{:.40}', expected cdr or ros1", name);
}

Result<RosOdometry> decode_odometry(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "nav_msgs/msg/Odometry", [](Cursor& in) {
    RosOdometry out;
    out.header = header(in);
    out.child_frame_id = text(in, "child_frame_id");
    out.pose = pose(in);
    numbers(in, out.pose_covariance, "pose.covariance");
    out.linear = vector(in, "twist.linear");
    out.angular = vector(in, "twist.angular");
    numbers(in, out.twist_covariance, "twist.covariance");
    return out;
  });
}

Result<RosOccupancyGrid> decode_occupancy_grid(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "nav_msgs/msg/OccupancyGrid", [](Cursor& in) {
    RosOccupancyGrid out;
    out.header = header(in);
    in.number<std::int32_t>("map_load_time.sec");
    in.number<std::uint32_t>("map_load_time.nanosec");
    out.resolution_m = static_cast<double>(in.number<float>("resolution"));
    out.width = in.number<std::uint32_t>("width");
    out.height = in.number<std::uint32_t>("height");
    out.origin = pose(in);
    const std::string_view cells = in.counted("data");
    if (cells.size() != std::uint64_t{out.width} * out.height)
      in.complain(fmt::format("{} cells, expected {} x {}", cells.size(), out.width, out.height));
    out.data = {reinterpret_cast<const std::int8_t*>(cells.data()), cells.size()};
    return out;
  });
}

Result<std::vector<RosTransform>> decode_tf(std::string_view bytes, RosEncoding encoding) {
  constexpr std::size_t kLeastBytes = 8 + 4 + 4 + 56;  // stamp, two empty strings, seven numbers
  return decode(bytes, encoding, "tf2_msgs/msg/TFMessage", [](Cursor& in) {
    std::vector<RosTransform> out(sequence(in, kLeastBytes, "transforms"));
    for (RosTransform& transform : out) {
      transform.header = header(in);
      transform.child_frame_id = text(in, "child_frame_id");
      transform.translation = vector(in, "translation");
      transform.rotation = quaternion(in, "rotation");
    }
    return out;
  });
}

Result<RosPointCloud> decode_point_cloud(std::string_view bytes, RosEncoding encoding) {
  constexpr std::size_t kLeastBytes = 4 + 4 + 1 + 4;
  return decode(bytes, encoding, "sensor_msgs/msg/PointCloud2", [](Cursor& in) {
    RosPointCloud out;
    out.header = header(in);
    out.height = in.number<std::uint32_t>("height");
    out.width = in.number<std::uint32_t>("width");
    out.fields.resize(sequence(in, kLeastBytes, "fields"));
    for (RosPointField& field : out.fields) {
      field.name = text(in, "field's name");
      field.offset = in.number<std::uint32_t>("field's offset");
      field.datatype = in.number<std::uint8_t>("field's datatype");
      field.count = in.number<std::uint32_t>("field's count");
    }
    out.is_bigendian = in.number<std::uint8_t>("is_bigendian") != 0;
    out.point_step = in.number<std::uint32_t>("point_step");
    out.row_step = in.number<std::uint32_t>("row_step");
    out.data = in.counted("data");
    out.is_dense = in.number<std::uint8_t>("is_dense") != 0;
    return out;
  });
}

/// Rows of one point each, so that the bytes that CDR puts between two points are the rows' padding.
Result<RosPointCloud> decode_livox(std::string_view bytes, RosEncoding encoding) {
  constexpr std::uint32_t kPointBytes = 19, kAlignedBytes = 20;
  constexpr std::uint8_t kUint32 = 6, kFloat32 = 7;
  return decode(bytes, encoding, "livox_ros_driver2/msg/CustomMsg", [](Cursor& in) {
    RosPointCloud out{.header = header(in)};
    in.number<std::uint64_t>("timebase");
    const auto stated = in.number<std::uint32_t>("point_num");
    for (const char* what : {"lidar_id", "rsvd[0]", "rsvd[1]", "rsvd[2]"}) in.number<std::uint8_t>(what);
    out.height = sequence(in, kPointBytes, "points");
    if (out.height != stated) in.complain(fmt::format("{} points, expected {} as point_num says", out.height, stated));
    out.width = 1;
    out.fields = {{"offset_time", 0, kUint32, 1}, {"x", 4, kFloat32, 1}, {"y", 8, kFloat32, 1}, {"z", 12, kFloat32, 1}};
    out.is_bigendian = in.order() == Cursor::Order::big;
    out.point_step = kPointBytes;
    out.row_step = in.layout() == Cursor::Layout::aligned ? kAlignedBytes : kPointBytes;
    const std::uint64_t before_last = out.height > 0 ? out.height - 1 : 0;
    out.data = in.take(before_last * out.row_step + (out.height > 0 ? kPointBytes : 0), "points");
    return out;
  });
}

bool is_scan_type(std::string_view type) {
  return std::ranges::find(kScanTypes, type, &ScanType::name) != kScanTypes.end();
}

Result<RosPointCloud> decode_scan(std::string_view type, std::string_view bytes, RosEncoding encoding) {
  const auto at = std::ranges::find(kScanTypes, type, &ScanType::name);
  if (at != kScanTypes.end()) return at->decode(bytes, encoding);
  return fail(ErrorCode::unsupported, "type '{:.200}', expected one that holds scans: {}", type,
              fmt::join(kScanTypes | std::views::transform(&ScanType::name), ", "));
}

Result<RosImu> decode_imu(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "sensor_msgs/msg/Imu", [](Cursor& in) {
    RosImu out;
    out.header = header(in);
    out.orientation = quaternion(in, "orientation");
    numbers(in, out.orientation_covariance, "orientation_covariance");
    out.angular_velocity = vector(in, "angular_velocity");
    numbers(in, out.angular_velocity_covariance, "angular_velocity_covariance");
    out.linear_acceleration = vector(in, "linear_acceleration");
    numbers(in, out.linear_acceleration_covariance, "linear_acceleration_covariance");
    return out;
  });
}

Result<RosImage> decode_image(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "sensor_msgs/msg/Image", [](Cursor& in) {
    RosImage out;
    out.header = header(in);
    out.height = in.number<std::uint32_t>("height");
    out.width = in.number<std::uint32_t>("width");
    out.encoding = text(in, "encoding");
    out.is_bigendian = in.number<std::uint8_t>("is_bigendian") != 0;
    out.step = in.number<std::uint32_t>("step");
    out.data = in.counted("data");
    return out;
  });
}

Result<RosCompressedImage> decode_compressed_image(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "sensor_msgs/msg/CompressedImage", [](Cursor& in) {
    RosCompressedImage out;
    out.header = header(in);
    out.format = text(in, "format");
    out.data = in.counted("data");
    return out;
  });
}

Result<RosCameraInfo> decode_camera_info(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "sensor_msgs/msg/CameraInfo", [](Cursor& in) {
    RosCameraInfo out;
    out.header = header(in);
    out.height = in.number<std::uint32_t>("height");
    out.width = in.number<std::uint32_t>("width");
    out.distortion_model = text(in, "distortion_model");
    out.d.resize(sequence(in, sizeof(double), "d"));
    numbers(in, out.d, "d");
    numbers(in, out.k, "k");
    numbers(in, out.r, "r");
    numbers(in, out.p, "p");
    out.binning_x = in.number<std::uint32_t>("binning_x");
    out.binning_y = in.number<std::uint32_t>("binning_y");
    for (int i = 0; i < 4; ++i) in.number<std::uint32_t>("roi");
    in.number<std::uint8_t>("roi.do_rectify");
    return out;
  });
}

Result<RosNavSatFix> decode_nav_sat_fix(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "sensor_msgs/msg/NavSatFix", [](Cursor& in) {
    RosNavSatFix out;
    out.header = header(in);
    out.status = in.number<std::int8_t>("status.status");
    out.service = in.number<std::uint16_t>("status.service");
    out.latitude_deg = in.number<double>("latitude");
    out.longitude_deg = in.number<double>("longitude");
    out.altitude_m = in.number<double>("altitude");
    numbers(in, out.position_covariance, "position_covariance");
    out.position_covariance_type = in.number<std::uint8_t>("position_covariance_type");
    return out;
  });
}

Result<RosRange> decode_range(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "sensor_msgs/msg/Range", [](Cursor& in) {
    RosRange out;
    out.header = header(in);
    in.number<std::uint8_t>("radiation_type");
    in.number<float>("field_of_view");
    out.min_range_m = in.number<float>("min_range");
    out.max_range_m = in.number<float>("max_range");
    out.range_m = in.number<float>("range");
    if (in.left() >= sizeof(float)) out.variance = in.number<float>("variance");
    return out;
  });
}

Result<RosBatteryState> decode_battery_state(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "sensor_msgs/msg/BatteryState", [](Cursor& in) {
    RosBatteryState out;
    out.header = header(in);
    out.voltage_v = in.number<float>("voltage");
    for (const char* what : {"temperature", "current", "charge", "capacity", "design_capacity"}) in.number<float>(what);
    out.percentage = in.number<float>("percentage");
    for (const char* what : {"power_supply_status", "power_supply_health", "power_supply_technology", "present"})
      in.number<std::uint8_t>(what);
    for (const char* what : {"cell_voltage", "cell_temperature"})
      for (std::size_t left = sequence(in, sizeof(float), what); left > 0; --left) in.number<float>(what);
    for (const char* what : {"location", "serial_number"}) text(in, what);
    return out;
  });
}

Result<RosPoseWithCovariance> decode_pose_with_covariance(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "geometry_msgs/msg/PoseWithCovarianceStamped", [](Cursor& in) {
    RosPoseWithCovariance out;
    out.header = header(in);
    out.pose = pose(in);
    numbers(in, out.covariance, "pose.covariance");
    return out;
  });
}

Result<RosPoseStamped> decode_pose_stamped(std::string_view bytes, RosEncoding encoding) {
  return decode(bytes, encoding, "geometry_msgs/msg/PoseStamped", [](Cursor& in) {
    RosPoseStamped out;
    out.header = header(in);
    out.pose = pose(in);
    return out;
  });
}

}  // namespace tutti::bags
