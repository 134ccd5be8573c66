// SPDX-License-Identifier: BSD-3-Clause
#include "ros_values.hpp"

#include <variant>

#include "tutti/bags/point_cloud.hpp"
#include "tutti/bags/ros_types.hpp"
#include "tutti/bags/transform_tree.hpp"

namespace tutti::python {
namespace {

using namespace bags;

py::dict begin(const RosHeader& header) {
  return py::dict("stamp"_a = to_seconds(header.stamp), "frame_id"_a = header.frame_id);
}

py::array_t<double> of(const Eigen::Vector3d& v) { return from_numbers({v.data(), 3}); }
py::array_t<double> of(const Eigen::Quaterniond& q) { return from_numbers({q.coeffs().data(), 4}); }
template <std::size_t n>
py::array_t<double> of(const std::array<double, n>& row_by_row, py::ssize_t rows) {
  py::array_t<double> out({rows, static_cast<py::ssize_t>(n) / rows});
  std::copy(row_by_row.begin(), row_by_row.end(), out.mutable_data());
  return out;
}

void put_pose(py::dict& out, const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation) {
  out["position"] = of(position);
  out["orientation"] = of(orientation);
  const auto T = bags::to_pose(position, orientation);
  out["T"] = T ? py::object(from_pose(*T)) : py::object(py::none());
}

py::dict dict_of(const RosOdometry& m) {
  py::dict out = begin(m.header);
  out["child_frame_id"] = m.child_frame_id;
  put_pose(out, m.pose.position, m.pose.orientation);
  out["pose_covariance"] = of(m.pose_covariance, 6);
  out["linear"] = of(m.linear);
  out["angular"] = of(m.angular);
  out["twist_covariance"] = of(m.twist_covariance, 6);
  return out;
}

py::dict dict_of(const std::vector<RosTransform>& transforms) {
  py::list list;
  for (const RosTransform& m : transforms) {
    py::dict one = begin(m.header);
    one["child_frame_id"] = m.child_frame_id;
    put_pose(one, m.translation, m.rotation);
    list.append(one);
  }
  return py::dict("transforms"_a = list);
}

py::dict dict_of(const RosPointCloud& m) {
  py::dict out = begin(m.header);
  const auto timed = value_of(to_timed_cloud(m));
  py::list fields;
  for (const RosPointField& field : m.fields) fields.append(field.name);
  out["fields"] = fields;
  out["points"] = from_cloud(timed.cloud);
  if (!timed.times.empty()) out["times"] = from_numbers(timed.times);
  return out;
}

py::dict dict_of(const RosImu& m) {
  py::dict out = begin(m.header);
  out["orientation"] = of(m.orientation);
  out["orientation_covariance"] = of(m.orientation_covariance, 3);
  out["angular_velocity"] = of(m.angular_velocity);
  out["angular_velocity_covariance"] = of(m.angular_velocity_covariance, 3);
  out["linear_acceleration"] = of(m.linear_acceleration);
  out["linear_acceleration_covariance"] = of(m.linear_acceleration_covariance, 3);
  return out;
}

py::dict dict_of(const RosImage& m) {
  py::dict out = begin(m.header);
  out["height"] = m.height;
  out["width"] = m.width;
  out["encoding"] = m.encoding;
  out["step"] = m.step;
  out["data"] = py::bytes(m.data.data(), m.data.size());
  return out;
}

py::dict dict_of(const RosCompressedImage& m) {
  py::dict out = begin(m.header);
  out["format"] = m.format;
  out["data"] = py::bytes(m.data.data(), m.data.size());
  return out;
}

py::dict dict_of(const RosCameraInfo& m) {
  py::dict out = begin(m.header);
  out["height"] = m.height;
  out["width"] = m.width;
  out["distortion_model"] = m.distortion_model;
  out["d"] = from_numbers(m.d);
  out["k"] = of(m.k, 3);
  out["r"] = of(m.r, 3);
  out["p"] = of(m.p, 3);
  return out;
}

py::dict dict_of(const RosNavSatFix& m) {
  py::dict out = begin(m.header);
  out["status"] = static_cast<int>(m.status);
  out["latitude_deg"] = m.latitude_deg;
  out["longitude_deg"] = m.longitude_deg;
  out["altitude_m"] = m.altitude_m;
  out["position_covariance"] = of(m.position_covariance, 3);
  out["position_covariance_type"] = static_cast<int>(m.position_covariance_type);
  return out;
}

py::dict dict_of(const RosBatteryState& m) {
  py::dict out = begin(m.header);
  out["voltage_v"] = m.voltage_v;
  out["percentage"] = m.percentage;
  return out;
}

py::dict dict_of(const RosRange& m) {
  py::dict out = begin(m.header);
  out["min_range_m"] = m.min_range_m;
  out["max_range_m"] = m.max_range_m;
  out["range_m"] = m.range_m;
  out["variance"] = m.variance;
  return out;
}

py::dict dict_of(const RosPoseStamped& m) {
  py::dict out = begin(m.header);
  put_pose(out, m.pose.position, m.pose.orientation);
  return out;
}

}  // namespace

py::dict decode(const BagChannel& channel, std::string_view data) {
  const RosEncoding encoding = value_of(to_encoding(channel.message_encoding));
  if (use_of(channel.type) == Use::nothing)
    refuse("{}: is of type '{}', which is not decoded", channel.topic, channel.type);
  return std::visit([](const auto& message) { return dict_of(message); },
                    value_of(decode_message(channel.type, data, encoding)));
}

StampedPose stamped_pose(const BagChannel& channel, std::string_view data) {
  const RosEncoding encoding = value_of(to_encoding(channel.message_encoding));
  RosHeader header;
  RosPose pose;
  if (channel.type == kOdometryType) {
    const auto message = value_of(decode_odometry(data, encoding));
    header = message.header;
    pose = message.pose;
  } else if (channel.type == kPoseType) {
    const auto message = value_of(decode_pose_stamped(data, encoding));
    header = message.header;
    pose = message.pose;
  } else {
    refuse("{}: is of type '{}', expected Odometry or PoseStamped", channel.topic, channel.type);
  }
  const auto T = bags::to_pose(pose.position, pose.orientation);
  if (!T) refuse("{}: the pose at {:.9f} s is no rigid transform", channel.topic, to_seconds(header.stamp));
  return {header.stamp, *T};
}

}  // namespace tutti::python
