// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_definitions.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/bags/internal/sha256.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/base/check.hpp"

namespace tutti::bags {
namespace {

constexpr std::string_view kPose = "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n";
constexpr std::string_view kXyz = "float64 x\nfloat64 y\nfloat64 z\n";
constexpr std::string_view kLivoxPoint =
    "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line\n";
constexpr std::string_view kLivox1Msg =
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
    "livox_ros_driver/CustomPoint[] points\n";
constexpr std::string_view kLivox2Msg =
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
    "livox_ros_driver2/CustomPoint[] points\n";
constexpr std::string_view kLivoxInterfacesMsg =
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
    "livox_interfaces/CustomPoint[] points\n";
constexpr std::string_view kTimeSpan = "int32 sec\nuint32 nanosec\n";

/// By short names, as definitions refer to each other: "nav_msgs/Odometry".
const std::map<std::string, std::string_view, std::less<>>& definitions() {
  static const std::map<std::string, std::string_view, std::less<>> all{
      {"builtin_interfaces/Duration", kTimeSpan},
      {"builtin_interfaces/Time", kTimeSpan},
      {"diagnostic_msgs/DiagnosticArray", "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
      {"diagnostic_msgs/DiagnosticStatus",
       "byte level\nstring name\nstring message\nstring hardware_id\ndiagnostic_msgs/KeyValue[] values\n"},
      {"diagnostic_msgs/KeyValue", "string key\nstring value\n"},
      {"geometry_msgs/Point", kXyz},
      {"geometry_msgs/Pose", kPose},
      {"geometry_msgs/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
      {"geometry_msgs/PoseWithCovarianceStamped", "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"},
      {"geometry_msgs/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
      {"geometry_msgs/Quaternion", "float64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"},
      {"geometry_msgs/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
      {"geometry_msgs/TransformStamped",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
      {"geometry_msgs/Twist", "geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n"},
      {"geometry_msgs/TwistWithCovariance", "geometry_msgs/Twist twist\nfloat64[36] covariance\n"},
      {"geometry_msgs/Vector3", kXyz},
      {"livox_interfaces/CustomMsg", kLivoxInterfacesMsg},
      {"livox_interfaces/CustomPoint", kLivoxPoint},
      {"livox_ros_driver/CustomMsg", kLivox1Msg},
      {"livox_ros_driver/CustomPoint", kLivoxPoint},
      {"livox_ros_driver2/CustomMsg", kLivox2Msg},
      {"livox_ros_driver2/CustomPoint", kLivoxPoint},
      {"nav_msgs/MapMetaData",
       "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\nuint32 height\n"
       "geometry_msgs/Pose origin\n"},
      {"nav_msgs/OccupancyGrid", "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data\n"},
      {"nav_msgs/Odometry",
       "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/PoseWithCovariance pose\n"
       "geometry_msgs/TwistWithCovariance twist\n"},
      {"nav_msgs/Path", "std_msgs/Header header\ngeometry_msgs/PoseStamped[] poses\n"},
      {"rosgraph_msgs/Clock", "builtin_interfaces/Time clock\n"},
      {"sensor_msgs/BatteryState",
       "std_msgs/Header header\nfloat32 voltage\nfloat32 temperature\nfloat32 current\nfloat32 charge\n"
       "float32 capacity\nfloat32 design_capacity\nfloat32 percentage\nuint8 power_supply_status\n"
       "uint8 power_supply_health\nuint8 power_supply_technology\nbool present\nfloat32[] cell_voltage\n"
       "float32[] cell_temperature\nstring location\nstring serial_number\n"},
      {"sensor_msgs/CameraInfo",
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n"
       "float64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n"},
      {"sensor_msgs/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
      {"sensor_msgs/Image",
       "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
       "uint8[] data\n"},
      {"sensor_msgs/Imu",
       "std_msgs/Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
       "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
       "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n"},
      {"sensor_msgs/NavSatFix",
       "std_msgs/Header header\nsensor_msgs/NavSatStatus status\nfloat64 latitude\nfloat64 longitude\n"
       "float64 altitude\nfloat64[9] position_covariance\nuint8 position_covariance_type\n"},
      {"sensor_msgs/NavSatStatus", "int8 status\nuint16 service\n"},
      {"sensor_msgs/PointCloud2",
       "std_msgs/Header header\nuint32 height\nuint32 width\nsensor_msgs/PointField[] fields\nbool is_bigendian\n"
       "uint32 point_step\nuint32 row_step\nuint8[] data\nbool is_dense\n"},
      {"sensor_msgs/PointField", "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"},
      {"sensor_msgs/Range",
       "std_msgs/Header header\nuint8 radiation_type\nfloat32 field_of_view\nfloat32 min_range\nfloat32 max_range\n"
       "float32 range\nfloat32 variance\n"},
      {"sensor_msgs/RegionOfInterest",
       "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
      {"std_msgs/ColorRGBA", "float32 r\nfloat32 g\nfloat32 b\nfloat32 a\n"},
      {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
      {"tf2_msgs/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
      {"visualization_msgs/Marker",
       "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n"
       "geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\n"
       "bool frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n"
       "sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n"
       "string mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials\n"},
      {"visualization_msgs/MarkerArray", "visualization_msgs/Marker[] markers\n"},
      {"visualization_msgs/MeshFile", "string filename\nuint8[] data\n"},
      {"visualization_msgs/UVCoordinate", "float32 u\nfloat32 v\n"},
  };
  return all;
}

std::string_view fields_of(std::string_view name) {
  const auto at = definitions().find(name);
  TUTTI_CHECK(at != definitions().end(), "no definition of {}", name);
  return at->second;
}

/// "nav_msgs/msg/Odometry" to "nav_msgs/Odometry", and back.
std::string short_name(std::string_view type) {
  TUTTI_CHECK(type.find("/msg/") != std::string_view::npos, "type '{}'", type);
  return type_of_ros1(type);
}
std::string full_name(std::string_view name) {
  const std::size_t at = name.find('/');
  return std::string(name.substr(0, at)).append("/msg").append(name.substr(at));
}

struct Field {
  std::string type;  ///< One element's.
  std::string name;
  std::optional<std::uint64_t> length;  ///< An array's,
  bool is_sequence = false;             ///< or it has as many as it states.
};

std::vector<Field> parse(std::string_view name) {
  std::istringstream lines{std::string(fields_of(name))};
  std::vector<Field> out;
  for (Field field; lines >> field.type >> field.name; field = {}) {
    if (const std::size_t at = field.type.find('['); at != std::string::npos) {
      field.is_sequence = field.type[at + 1] == ']';
      if (!field.is_sequence) field.length = std::stoull(field.type.substr(at + 1));
      field.type.resize(at);
    }
    out.push_back(field);
  }
  return out;
}

bool is_made_of_others(const Field& field) { return field.type.find('/') != std::string::npos; }

/// All that a type is made of, but itself.
void collect(std::string_view name, std::map<std::string, std::vector<Field>>& out) {
  for (const Field& field : parse(name))
    if (is_made_of_others(field) && out.try_emplace(field.type, parse(field.type)).second) collect(field.type, out);
}

int type_id(const Field& field) {
  constexpr std::array<std::pair<std::string_view, int>, 14> kIds{{{"int8", 2},
                                                                   {"uint8", 3},
                                                                   {"int16", 4},
                                                                   {"uint16", 5},
                                                                   {"int32", 6},
                                                                   {"uint32", 7},
                                                                   {"int64", 8},
                                                                   {"uint64", 9},
                                                                   {"float32", 10},
                                                                   {"float64", 11},
                                                                   {"bool", 15},
                                                                   {"byte", 16},
                                                                   {"string", 17},
                                                                   {"", 0}}};
  constexpr int kNested = 1, kArray = 48, kSequence = 144;
  const int many = field.length ? kArray : field.is_sequence ? kSequence : 0;
  if (is_made_of_others(field)) return many + kNested;
  for (const auto& [name, id] : kIds)
    if (name == field.type) return many + id;
  TUTTI_CHECK(false, "type '{}'", field.type);
  return 0;
}

std::string describe(const std::string& name, const std::vector<Field>& fields) {
  std::string out = fmt::format(R"({{"type_name": "{}", "fields": [)", full_name(name));
  for (std::size_t i = 0; i < fields.size(); ++i)
    out += fmt::format(
        R"({}{{"name": "{}", "type": {{"type_id": {}, "capacity": {}, "string_capacity": 0, "nested_type_name": "{}"}}}})",
        i > 0 ? ", " : "", fields[i].name, type_id(fields[i]), fields[i].length.value_or(0),
        is_made_of_others(fields[i]) ? full_name(fields[i].type) : "");
  return out + "]}";
}

}  // namespace

bool has_ros_definition(const std::string& type) {
  return type.find("/msg/") != std::string::npos && definitions().contains(short_name(type));
}

std::string ros_definition(const std::string& type) {
  const std::string name = short_name(type);
  std::map<std::string, std::vector<Field>> others;
  collect(name, others);
  std::string out(fields_of(name));
  for (const auto& [other, fields] : others) out += fmt::format("{:=<80}\nMSG: {}\n{}", "", other, fields_of(other));
  return out;
}

std::string ros_type_hash(const std::string& type) {
  const std::string name = short_name(type);
  std::map<std::string, std::vector<Field>> others;
  collect(name, others);
  std::string referenced;
  for (const auto& [other, fields] : others) referenced += (referenced.empty() ? "" : ", ") + describe(other, fields);
  return "RIHS01_" + internal::sha256(fmt::format(R"({{"type_description": {}, "referenced_type_descriptions": [{}]}})",
                                                  describe(name, parse(name)), referenced));
}

}  // namespace tutti::bags
