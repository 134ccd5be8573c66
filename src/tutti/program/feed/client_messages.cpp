// SPDX-License-Identifier: BSD-3-Clause
#include <google/protobuf/io/coded_stream.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/base/plain_text.hpp"
#include "tutti/program/feed/feed_frames.hpp"
#include "tutti/v1/feed.pb.h"
#include "tutti/wire/field_bytes.hpp"

namespace tutti::program {
namespace {

Pose3 read(const v1::Feed::Pose& in) {
  return {Eigen::Quaterniond(in.qw(), in.qx(), in.qy(), in.qz()), {in.x(), in.y(), in.z()}};
}

Result<Matrix6d> read_covariance(const google::protobuf::RepeatedField<double>& numbers, const char* name) {
  if (numbers.size() != 6 && numbers.size() != 36)
    return fail(ErrorCode::invalid, "{} of {} numbers, expected 36, or 6 of its diagonal", name, numbers.size());
  Matrix6d out = Matrix6d::Zero();
  for (int i = 0; i < numbers.size(); ++i) {
    if (numbers.size() == 6)
      out(i, i) = numbers.Get(i);
    else
      out(i / 6, i % 6) = numbers.Get(i);
  }
  return out;
}

FromClient read(const v1::Feed::Odometry& in) {
  const Timestamp stamp{in.stamp_ns()};
  if (!in.has_t_odom_body()) return BadSample{stamp, "an odometry sample without T_odom_body"};
  OdometrySample out{.stamp = stamp, .T_odom_body = read(in.t_odom_body())};
  const auto covariance = read_covariance(in.increment_covariance(), "increment_covariance");
  if (!covariance) return BadSample{stamp, "an " + covariance.error().message};
  out.increment_covariance = *covariance;
  return out;
}

FromClient read(const v1::Feed::StartPose& in) {
  if (!in.has_t_world_body()) return StartPose{};
  const auto covariance = read_covariance(in.covariance(), "covariance");
  if (!covariance) return BadSample{{}, "a start pose with a " + covariance.error().message};
  StartPose out{.T_world_body = RelativePose{read(in.t_world_body()), *covariance}, .is_planar = in.is_planar()};
  if (in.floor() > 0) out.floor = in.floor();
  if (const Status ok = check_start_pose(out); !ok) return BadSample{{}, ok.error().message};
  return out;
}

FromClient read(const v1::Feed::Scan& in) {
  const Timestamp stamp{in.stamp_ns()};
  if (in.xyz_size() % 3 != 0)
    return BadSample{stamp, fmt::format("a scan of {} coordinates, expected three a point", in.xyz_size())};
  const int points = in.xyz_size() / 3;
  if (in.age_s_size() != 0 && in.age_s_size() != points)
    return BadSample{stamp, fmt::format("a scan of {} points and {} ages", points, in.age_s_size())};
  PointCloud cloud;
  cloud.points.reserve(static_cast<std::size_t>(points));
  for (int i = 0; i < points; ++i) cloud.points.emplace_back(in.xyz(3 * i), in.xyz(3 * i + 1), in.xyz(3 * i + 2));
  Scan out{.stamp = stamp, .cloud = std::make_shared<const PointCloud>(std::move(cloud)), .age_s = {}};
  if (in.age_s_size() > 0) out.age_s = std::make_shared<const std::vector<float>>(in.age_s().begin(), in.age_s().end());
  return out;
}

Camera read(const v1::Feed::Camera& in) {
  constexpr std::uint32_t kLargest = 1U << 30U;
  Camera out{.model = {.kind = static_cast<CameraKind>(in.kind()),
                       .width_px = static_cast<int>(std::min(in.width_px(), kLargest)),
                       .height_px = static_cast<int>(std::min(in.height_px(), kLargest)),
                       .fx = in.fx(),
                       .fy = in.fy(),
                       .cx = in.cx(),
                       .cy = in.cy()},
             .T_body_camera = read(in.t_body_camera())};
  std::copy(in.distortion().begin(), in.distortion().end(), out.model.distortion.begin());
  return out;
}

double or_default(double value, double otherwise) { return value == 0.0 ? otherwise : value; }

Result<Sensors> read(const v1::Feed::Sensors& in) {
  Sensors out{.scans = in.scans(), .cameras = {}, .depth = {}, .imu = {}};
  for (const v1::Feed::Camera& camera : in.camera()) {
    if (!v1::Feed::Camera::Kind_IsValid(camera.kind()))
      return fail(ErrorCode::unsupported, "a camera of a kind ({}) that this program does not know",
                  static_cast<int>(camera.kind()));
    if (camera.distortion_size() > static_cast<int>(CameraModel().distortion.size()))
      return fail(ErrorCode::invalid, "a camera with {} numbers of distortion, expected at most {}",
                  camera.distortion_size(), CameraModel().distortion.size());
    if (!camera.has_t_body_camera()) return fail(ErrorCode::invalid, "a camera without T_body_camera");
    out.cameras.push_back(read(camera));
  }
  if (in.has_depth())
    out.depth = DepthSensor{in.depth().unit_m(), in.depth().sigma_m(), in.depth().sigma_per_m2(), in.depth().least_m(),
                            in.depth().most_m()};
  if (in.has_imu()) {
    const ImuNoise usual;
    out.imu = ImuNoise{or_default(in.imu().gyro_noise_density(), usual.gyro_noise_density),
                       or_default(in.imu().gyro_random_walk(), usual.gyro_random_walk),
                       or_default(in.imu().accelerometer_noise_density(), usual.accelerometer_noise_density),
                       or_default(in.imu().accelerometer_random_walk(), usual.accelerometer_random_walk)};
  }
  if (auto ok = check_sensors(out); !ok) return tl::unexpected(ok.error());
  return out;
}

Result<std::optional<FeedRos>> read(const v1::Feed::Ros& in) {
  constexpr double kMost_s = 1e6, kMostNoise = 1e3;
  FeedRos out{.images = {in.images().begin(), in.images().end()},
              .depth = in.depth(),
              .imu = in.imu(),
              .scans_deskewed = in.scans_deskewed(),
              .body_frame = in.body_frame(),
              .odom_frame = plain_text(in.odom_frame()),
              .map_frame = plain_text(in.map_frame()),
              .world_frame = plain_text(in.world_frame()),
              .tolerance_s = in.tolerance_s()};
  if (in.has_images_offset_s()) out.images_offset_s = in.images_offset_s();
  if (!(std::abs(out.tolerance_s) < kMost_s) || !(std::abs(out.images_offset_s.value_or(0.0)) < kMost_s))
    return fail(ErrorCode::invalid, "tolerance_s {}, images_offset_s {}: expected less than {} s", out.tolerance_s,
                out.images_offset_s.value_or(0.0), kMost_s);
  if (in.has_t_body_lidar()) {
    out.T_body_lidar = read(in.t_body_lidar());
    const double norm = out.T_body_lidar->rotation.norm();
    if (!out.T_body_lidar->translation.allFinite() || !(std::abs(norm - 1.0) < 0.01))
      return fail(ErrorCode::invalid, "T_body_lidar is no pose: its quaternion has norm {}", norm);
    out.T_body_lidar->rotation.normalize();
  }
  const auto& antenna = in.p_body_antenna();
  const auto& noise = in.noise();
  if (antenna.size() == 3)
    out.p_body_antenna = Eigen::Vector3d(antenna.Get(0), antenna.Get(1), antenna.Get(2));
  else if (!antenna.empty())
    return fail(ErrorCode::invalid, "p_body_antenna of {} numbers, expected 3 or none", antenna.size());
  if (noise.size() == 6)
    out.covariance.emplace(robot::OdometryCovarianceConfig{noise.Get(0), noise.Get(1), noise.Get(2), noise.Get(3),
                                                           noise.Get(4), noise.Get(5)});
  else if (!noise.empty())
    return fail(ErrorCode::invalid, "noise of {} numbers, expected 6 or none", noise.size());
  for (int i = 0; i < noise.size(); ++i) {
    const bool is_per_second = i % 3 == 2;  // without which standing still would be certain
    if (!(noise.Get(i) >= 0.0 && noise.Get(i) < kMostNoise) || (is_per_second && noise.Get(i) == 0.0))
      return fail(ErrorCode::invalid, "noise {}: expected {} and less than {}", noise.Get(i),
                  is_per_second ? "more than 0" : "at least 0", kMostNoise);
  }
  return std::optional(std::move(out));
}

FromClient read(v1::Feed::Hello& in) {
  FeedHello out{.version = in.protocol_version(),
                .client = plain_text(in.client_name()),
                .listens_only = in.listens_only(),
                .wants_trajectory = in.wants_trajectory()};
  if (in.has_sensors()) out.sensors = read(in.sensors());
  if (in.has_ros()) out.ros = read(in.ros());
  if (in.has_clock_offset_ns()) out.clock_offset_ns = in.clock_offset_ns();
  if (in.has_clock_now_ns()) out.clock_now_ns = in.clock_now_ns();
  return out;
}

EncodedImage read(v1::Feed::Image& in) {
  return {in.camera(), in.encoding() == v1::Feed::Image::RAW, std::move(*in.mutable_data())};
}

FromClient read(v1::Feed::Images& in) {
  EncodedImages out{.stamp = {in.stamp_ns()}, .images = {}, .depth = {}};
  const auto is_known = [](const v1::Feed::Image& image) {
    return v1::Feed::Image::Encoding_IsValid(image.encoding());
  };
  constexpr int kMostImages = 16;
  if (in.image_size() > kMostImages)
    return BadSample{out.stamp, fmt::format("{} images of one moment, expected one of each camera", in.image_size())};
  if (!std::ranges::all_of(in.image(), is_known) || (in.has_depth() && !is_known(in.depth())))
    return BadSample{out.stamp, "an image of an encoding that this program does not know"};
  for (v1::Feed::Image& image : *in.mutable_image()) out.images.push_back(read(image));
  if (in.has_depth()) out.depth = read(*in.mutable_depth());
  return out;
}

/// Its values are checked where it is taken (check_fix()).
FromClient read(const v1::Feed::Fix& in) {
  PositionFix out{.stamp = {in.stamp_ns()}, .antenna = {in.latitude_deg(), in.longitude_deg(), in.height_m()}};
  const auto& numbers = in.covariance_m2();
  if (numbers.size() != 0 && numbers.size() != 3 && numbers.size() != 9)
    return BadSample{
        out.stamp,
        fmt::format("a fix with covariance_m2 of {} numbers, expected 9, 3 of its diagonal, or none", numbers.size())};
  if (in.p_body_antenna_size() != 0 && in.p_body_antenna_size() != 3)
    return BadSample{out.stamp, fmt::format("a fix with p_body_antenna of {} numbers, expected 3 or none",
                                            in.p_body_antenna_size())};
  if (!numbers.empty()) out.covariance.setZero();
  for (int i = 0; i < numbers.size(); ++i) {
    if (numbers.size() == 3)
      out.covariance(i, i) = numbers.Get(i);
    else
      out.covariance(i / 3, i % 3) = numbers.Get(i);
  }
  for (int i = 0; i < in.p_body_antenna_size(); ++i) out.p_body_antenna[i] = in.p_body_antenna(i);
  return out;
}

FromClient read(const v1::Feed::Health& in) {
  auto health = wire::read_fields<Health>(in.SerializeAsString());
  if (!health) return BadSample{{}, health.error().message};
  if (const Status ok = wire::check_fields(*health); !ok) return BadSample{{}, "health: " + ok.error().message};
  return *health;
}

/// Its values are checked where it is taken (check_range()).
FromClient read(const v1::Feed::Range& in) {
  auto range = wire::read_fields<RobotRange>(in.SerializeAsString());
  if (!range) return BadSample{{in.stamp_ns()}, range.error().message};
  range->name = in.name();
  return Input(std::move(*range));
}

FromClient read(v1::Feed::Raw& in) {
  return FeedRaw{std::move(*in.mutable_topic()), std::move(*in.mutable_type()), std::move(*in.mutable_encoding()),
                 std::move(*in.mutable_data())};
}

FromClient read(const v1::Feed::Imu& in) {
  const int samples = in.stamp_ns_size();
  const Timestamp first{samples > 0 ? in.stamp_ns(0) : 0};
  if (samples == 0 || static_cast<std::size_t>(samples) > kMaxImuSamples || in.gyro_size() != 3 * samples ||
      in.accelerometer_size() != 3 * samples)
    return BadSample{first, fmt::format("{} IMU samples with {} numbers of the gyro and {} of the accelerometer, "
                                        "expected 1 to {} samples and three numbers of both for each",
                                        samples, in.gyro_size(), in.accelerometer_size(), kMaxImuSamples)};
  std::vector<ImuSample> out;
  out.reserve(static_cast<std::size_t>(samples));
  for (int i = 0; i < samples; ++i) {
    const auto vector = [&](const auto& of) {
      return Eigen::Vector3d(of.Get(3 * i), of.Get(3 * i + 1), of.Get(3 * i + 2));
    };
    out.push_back({{in.stamp_ns(i)}, vector(in.gyro()), vector(in.accelerometer())});
    const ImuSample& sample = out.back();
    if (!sample.gyro.allFinite() || !sample.accelerometer.allFinite())
      return BadSample{sample.stamp, "an IMU sample that is not finite"};
  }
  return out;
}

/// Exactly one message, and none that robots send: protobuf prints what it thinks of their text. Its number.
Result<std::uint32_t> number_of_client(const char* bytes, int size) {
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes), size);
  const std::uint32_t tag = in.ReadTag(), number = tag >> 3U;
  std::uint32_t length = 0;
  constexpr std::uint32_t kLengthDelimited = 2;
  if (static_cast<std::size_t>(size) > kMaxFeedBytes || (tag & 7U) != kLengthDelimited || !in.ReadVarint32(&length) ||
      length != static_cast<std::uint32_t>(size - in.CurrentPosition()))
    return fail(ErrorCode::parse, "a frame that holds no Feed message");
  if (number >= v1::Feed::kWelcomeFieldNumber && number <= v1::Feed::kNoteFieldNumber)
    return fail(ErrorCode::parse, "a message that clients do not send (number {})", number);
  return number;
}

}  // namespace

Result<FromClient> decode_from_client(std::string_view payload) {
  v1::Feed message;
  const auto bytes = static_cast<int>(std::min(payload.size(), kMaxFeedBytes + 1));
  const auto number = number_of_client(payload.data(), bytes);
  if (!number) return tl::unexpected(number.error());
  if (*number > std::size(kFromClient)) return FeedUnknown{*number};
  if (!message.ParseFromArray(payload.data(), bytes))
    return fail(ErrorCode::parse, "a frame that holds no Feed message");
  switch (message.what_case()) {
    case v1::Feed::kHello:
      return read(*message.mutable_hello());
    case v1::Feed::kOdometry:
      return read(message.odometry());
    case v1::Feed::kScan:
      return read(message.scan());
    case v1::Feed::kEndOfRecording:
      return FeedEnd{};
    case v1::Feed::kImages:
      return read(*message.mutable_images());
    case v1::Feed::kImu:
      return read(message.imu());
    case v1::Feed::kFix:
      return read(message.fix());
    case v1::Feed::kRange:
      return read(message.range());
    case v1::Feed::kHealth:
      return read(message.health());
    case v1::Feed::kRaw:
      return read(*message.mutable_raw());
    case v1::Feed::kStartPose:
      return read(message.start_pose());
    case v1::Feed::kTime:
      return FeedTime{message.time().clock_now_ns()};
    default:
      return fail(ErrorCode::parse, "a frame that holds no Feed message");
  }
}

}  // namespace tutti::program
