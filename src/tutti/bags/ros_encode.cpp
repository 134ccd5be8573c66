// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/bags/ros_encode.hpp"

#include "tutti/bags/internal/byte_writer.hpp"

namespace tutti::bags {
namespace {

using internal::ByteWriter;

class Cdr {
 public:
  template <class T>
  Cdr& number(T value) {
    out_.number(value);
    return *this;
  }
  Cdr& numbers(std::span<const double> values) {
    out_.numbers(values);
    return *this;
  }
  Cdr& vector(const Eigen::Vector3d& value) { return numbers({value.data(), 3}); }
  /// ROS and Eigen both store x, y, z, w.
  Cdr& quaternion(const Eigen::Quaterniond& value) { return numbers({value.coeffs().data(), 4}); }
  Cdr& pose(const RosPose& value) { return vector(value.position).quaternion(value.orientation); }
  /// With a NUL, which the length counts.
  Cdr& text(std::string_view value) {
    out_.number(static_cast<std::uint32_t>(value.size() + 1)).raw(value).number<std::uint8_t>(0);
    return *this;
  }
  Cdr& bytes(std::string_view value) {
    out_.counted(value);
    return *this;
  }
  template <class List>
  Cdr& count(const List& list) {
    return number(static_cast<std::uint32_t>(list.size()));
  }
  /// Before 1970 the seconds are negative and the rest is not.
  Cdr& time(Timestamp stamp) {
    constexpr std::int64_t kPerSecond = 1'000'000'000;
    const std::int64_t rest = ((stamp.ns % kPerSecond) + kPerSecond) % kPerSecond;
    number(static_cast<std::int32_t>((stamp.ns - rest) / kPerSecond));
    return number(static_cast<std::uint32_t>(rest));
  }
  Cdr& header(const RosHeader& value) { return time(value.stamp).text(value.frame_id); }
  std::string done() { return std::string("\0\1\0\0", 4) + out_.take(); }

 private:
  ByteWriter out_{ByteWriter::Layout::aligned};
};

/// The fields that differ between the visualization_msgs/msg/Marker that are written.
struct Marker {
  enum Type : std::int32_t { none = 0, sphere = 2, line_list = 5, text_view_facing = 9 };
  enum Action : std::int32_t { add = 0, delete_all = 3 };
  const RosHeader& header;
  std::string_view name_space;
  std::int32_t id = 0;
  Type type = none;
  Action action = add;
  RosPose pose;
  Eigen::Vector3d scale = Eigen::Vector3d::Zero();
  std::array<float, 4> rgba{};
  std::span<const Eigen::Vector3d> points;
  std::string_view text;
};

void put(Cdr& out, const Marker& marker) {
  out.header(marker.header).text(marker.name_space).number(marker.id).number<std::int32_t>(marker.type);
  out.number<std::int32_t>(marker.action).pose(marker.pose).vector(marker.scale);
  for (const float channel : marker.rgba) out.number(channel);
  out.number<std::int32_t>(0).number<std::uint32_t>(0).number<std::uint8_t>(0);  // for ever, not locked to the frame
  out.count(marker.points);
  for (const Eigen::Vector3d& point : marker.points) out.vector(point);
  out.number<std::uint32_t>(0).text("");                       // colours, texture
  out.header({}).text("").bytes("").number<std::uint32_t>(0);  // which is no image
  out.text(marker.text).text("").text("").bytes("").number<std::uint8_t>(0);
}

}  // namespace

RosPose to_ros(const Pose3& T_frame_body) { return {T_frame_body.translation, T_frame_body.rotation}; }

RosNavSatFix to_ros(const RosHeader& header, const Geodetic& place) {
  RosNavSatFix out{.header = header};
  out.latitude_deg = place.latitude_deg;
  out.longitude_deg = place.longitude_deg;
  out.altitude_m = place.height_m;
  return out;
}

std::array<double, 36> to_ros(const Matrix6d& matrix) {
  std::array<double, 36> out{};
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = matrix(static_cast<Eigen::Index>(i / 6), static_cast<Eigen::Index>(i % 6));
  return out;
}

std::array<double, 36> pose_covariance(const Matrix6d& covariance, const Eigen::Quaterniond& R_frame_body) {
  return to_ros(covariance_of(covariance, R_frame_body.conjugate()));
}

Matrix6d covariance_of(const Matrix6d& pose_covariance, const Eigen::Quaterniond& R_frame_body) {
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R_frame_body.toRotationMatrix().transpose();
  return turn * pose_covariance * turn.transpose();
}

std::string encode(const RosOdometry& message) {
  Cdr out;
  out.header(message.header).text(message.child_frame_id);
  out.pose(message.pose).numbers(message.pose_covariance);
  return out.vector(message.linear).vector(message.angular).numbers(message.twist_covariance).done();
}

std::string encode(std::span<const RosTransform> message) {
  Cdr out;
  out.count(message);
  for (const RosTransform& transform : message)
    out.header(transform.header)
        .text(transform.child_frame_id)
        .vector(transform.translation)
        .quaternion(transform.rotation);
  return out.done();
}

std::string encode(const RosPointCloud& message) {
  Cdr out;
  out.header(message.header).number(message.height).number(message.width).count(message.fields);
  for (const RosPointField& field : message.fields)
    out.text(field.name).number(field.offset).number(field.datatype).number(field.count);
  out.number<std::uint8_t>(message.is_bigendian ? 1 : 0).number(message.point_step).number(message.row_step);
  return out.bytes(message.data).number<std::uint8_t>(message.is_dense ? 1 : 0).done();
}

std::string encode(const RosImu& message) {
  Cdr out;
  out.header(message.header).quaternion(message.orientation).numbers(message.orientation_covariance);
  out.vector(message.angular_velocity).numbers(message.angular_velocity_covariance);
  return out.vector(message.linear_acceleration).numbers(message.linear_acceleration_covariance).done();
}

std::string encode(const RosImage& message) {
  Cdr out;
  out.header(message.header).number(message.height).number(message.width).text(message.encoding);
  return out.number<std::uint8_t>(message.is_bigendian ? 1 : 0).number(message.step).bytes(message.data).done();
}

std::string encode(const RosCompressedImage& message) {
  return Cdr().header(message.header).text(message.format).bytes(message.data).done();
}

std::string encode(const RosCameraInfo& message) {
  Cdr out;
  out.header(message.header).number(message.height).number(message.width).text(message.distortion_model);
  out.count(message.d).numbers(message.d).numbers(message.k).numbers(message.r).numbers(message.p);
  out.number(message.binning_x).number(message.binning_y);
  for (int i = 0; i < 4; ++i) out.number<std::uint32_t>(0);  // roi: all of the image
  return out.number<std::uint8_t>(0).done();
}

std::string encode(const RosNavSatFix& message) {
  Cdr out;
  out.header(message.header).number(message.status).number(message.service);
  out.number(message.latitude_deg).number(message.longitude_deg).number(message.altitude_m);
  return out.numbers(message.position_covariance).number(message.position_covariance_type).done();
}

std::string encode(const RosRange& message) {
  Cdr out;
  out.header(message.header).number<std::uint8_t>(0).number(0.0F);  // radiation and field of view
  return out.number(message.min_range_m)
      .number(message.max_range_m)
      .number(message.range_m)
      .number(message.variance)
      .done();
}

std::string encode(const RosPoseStamped& message) { return Cdr().header(message.header).pose(message.pose).done(); }

std::string encode(const RosPoseWithCovariance& message) {
  return Cdr().header(message.header).pose(message.pose).numbers(message.covariance).done();
}

std::string encode(const RosOccupancyGrid& message) {
  Cdr out;
  out.header(message.header).time(message.header.stamp).number(static_cast<float>(message.resolution_m));
  out.number(message.width).number(message.height).pose(message.origin);
  return out.bytes({reinterpret_cast<const char*>(message.data.data()), message.data.size()}).done();
}

std::string encode_clock(Timestamp now) { return Cdr().time(now).done(); }

std::string encode(const RosPath& message) {
  Cdr out;
  out.header(message.header).count(message.poses);
  for (const RosPoseStamped& pose : message.poses) out.header(pose.header).pose(pose.pose);
  return out.done();
}

std::string encode(std::span<const RosLines> message) {
  Cdr out;
  out.count(message);
  for (const RosLines& lines : message)
    put(out, {.header = lines.header,
              .name_space = lines.name_space,
              .id = lines.id,
              .type = Marker::line_list,
              .scale = {lines.width_m, 0.0, 0.0},
              .rgba = lines.rgba,
              .points = lines.points});
  return out.done();
}

std::string encode(const RosHeader& header, std::span<const RosBall> message) {
  Cdr out;
  out.number(static_cast<std::uint32_t>(1 + 2 * message.size()));
  put(out, {.header = header, .action = Marker::delete_all});
  std::int32_t id = 0;
  for (const RosBall& ball : message) {
    Marker marker{.header = ball.header,
                  .name_space = ball.name_space,
                  .id = id++,
                  .type = Marker::sphere,
                  .pose = ball.pose,
                  .scale = Eigen::Vector3d::Constant(ball.diameter_m),
                  .rgba = ball.rgba};
    put(out, marker);
    marker.id = id++;
    marker.type = Marker::text_view_facing;
    marker.pose.position.z() += 1.6 * ball.diameter_m;
    marker.text = ball.name;
    put(out, marker);
  }
  return out.done();
}

std::string encode(const RosHeader& header, std::span<const RosDiagnostic> message) {
  Cdr out;
  out.header(header).count(message);
  for (const RosDiagnostic& status : message) {
    out.number(status.level).text(status.name).text(status.message).text(status.hardware_id).count(status.values);
    for (const auto& [key, value] : status.values) out.text(key).text(value);
  }
  return out.done();
}

}  // namespace tutti::bags
