// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_frames.hpp"

#include <google/protobuf/io/coded_stream.h>

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/v1/feed.pb.h"

namespace tutti::program {
namespace {

constexpr std::size_t kHeaderBytes = 4;

void write(const Pose3& T, v1::Feed::Pose& out) {
  out.set_x(T.translation.x());
  out.set_y(T.translation.y());
  out.set_z(T.translation.z());
  out.set_qx(T.rotation.x());
  out.set_qy(T.rotation.y());
  out.set_qz(T.rotation.z());
  out.set_qw(T.rotation.w());
}
Pose3 read(const v1::Feed::Pose& in) {
  return {Eigen::Quaterniond(in.qw(), in.qx(), in.qy(), in.qz()), {in.x(), in.y(), in.z()}};
}

FromClient read(const v1::Feed::Odometry& in) {
  const Timestamp stamp{in.stamp_ns()};
  if (!in.has_t_odom_body()) return BadSample{stamp, "an odometry sample without T_odom_body"};
  node::OdometrySample out{.stamp = stamp, .T_odom_body = read(in.t_odom_body())};
  const auto& numbers = in.increment_covariance();
  if (numbers.size() != 6 && numbers.size() != 36)
    return BadSample{
        stamp, fmt::format("an increment_covariance of {} numbers, expected 36, or 6 of its diagonal", numbers.size())};
  for (int i = 0; i < numbers.size(); ++i) {
    if (numbers.size() == 6)
      out.increment_covariance(i, i) = numbers.Get(i);
    else
      out.increment_covariance(i / 6, i % 6) = numbers.Get(i);
  }
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

/// Exactly one message, and none that robots send: protobuf prints what it thinks of their text.
Status check_is_one_of_clients(const char* bytes, int size) {
  google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(bytes), size);
  const std::uint32_t tag = in.ReadTag(), number = tag >> 3U;
  std::uint32_t length = 0;
  constexpr std::uint32_t kLengthDelimited = 2;
  if (static_cast<std::size_t>(size) > kMaxFeedBytes || (tag & 7U) != kLengthDelimited || !in.ReadVarint32(&length) ||
      length != static_cast<std::uint32_t>(size - in.CurrentPosition()))
    return fail(ErrorCode::parse, "a frame that holds no Feed message");
  if (number > v1::Feed::kEndOfRecordingFieldNumber)
    return fail(ErrorCode::parse, "a message that clients do not send (number {})", number);
  return {};
}

std::string framed(const v1::Feed& message) {
  const std::string payload = message.SerializeAsString();
  TUTTI_CHECK(payload.size() <= kMaxFeedBytes, "a feed message of {} bytes", payload.size());
  std::string out;
  for (std::size_t i = 0; i < kHeaderBytes; ++i) out += static_cast<char>(payload.size() >> (8 * i) & 0xffU);
  return out + payload;
}

/// Text goes out as UTF-8, which protobuf asks for: what is not plain becomes '?'.
std::string plain(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

}  // namespace

Result<std::optional<std::string>> FrameReader::take(std::string_view& bytes) {
  const auto fill = [&](std::string& part, std::size_t size) {
    const std::size_t count = std::min(size - part.size(), bytes.size());
    part.append(bytes.substr(0, count));
    bytes.remove_prefix(count);
    return part.size() == size;
  };
  if (!fill(header_, kHeaderBytes)) return std::nullopt;
  std::size_t size = 0;
  for (std::size_t i = 0; i < kHeaderBytes; ++i) size |= std::size_t{static_cast<unsigned char>(header_[i])} << (8 * i);
  if (size == 0 || size > kMaxFeedBytes)
    return fail(ErrorCode::parse, "a frame of {} bytes, expected 1 to {}", size, kMaxFeedBytes);
  if (!fill(payload_, size)) return std::nullopt;
  header_.clear();
  return std::exchange(payload_, {});
}

Result<FromClient> decode_from_client(std::string_view payload) {
  v1::Feed message;
  const auto bytes = static_cast<int>(std::min(payload.size(), kMaxFeedBytes + 1));
  if (auto ok = check_is_one_of_clients(payload.data(), bytes); !ok) return tl::unexpected(ok.error());
  if (!message.ParseFromArray(payload.data(), bytes))
    return fail(ErrorCode::parse, "a frame that holds no Feed message");
  switch (message.what_case()) {
    case v1::Feed::kHello:
      return FeedHello{message.hello().protocol_version(), plain(message.hello().client_name()),
                       message.hello().listens_only()};
    case v1::Feed::kOdometry:
      return read(message.odometry());
    case v1::Feed::kScan:
      return read(message.scan());
    case v1::Feed::kEndOfRecording:
      return FeedEnd{};
    default:
      return fail(ErrorCode::parse, "a frame that holds no Feed message");
  }
}

std::string welcome_frame(const FeedState& state, const Pose3& T_map_odom) {
  v1::Feed message;
  auto& out = *message.mutable_welcome();
  out.set_protocol_version(kFeedVersion);
  out.set_robot_name(plain(state.name));
  out.set_robot(state.chain.robot.value);
  out.set_session(state.chain.session);
  out.set_has_odometry(state.newest.has_value());
  if (state.newest) out.set_last_stamp_ns(state.newest->stamp.ns);
  write(T_map_odom, *out.mutable_t_map_odom());
  return framed(message);
}

std::string correction_frame(const FeedState& state, const SmoothMap::Answer& answer, std::uint64_t dropped) {
  v1::Feed message;
  auto& out = *message.mutable_correction();
  out.set_stamp_ns(state.newest->stamp.ns);
  write(answer.T_map_odom * state.newest->pose, *out.mutable_t_map_body());
  write(answer.T_map_odom, *out.mutable_t_map_odom());
  for (const double x : answer.covariance.reshaped()) out.add_t_map_odom_covariance(x);
  out.set_map_epoch(state.map_age.first);
  out.set_map_revision(state.map_age.second);
  out.set_in_map(state.component.has_value());
  out.set_wants_scan(state.wants_scan);
  out.set_dropped(dropped);
  out.set_has_stored(state.stored.has_value());
  if (state.stored) out.set_stored_stamp_ns(state.stored->ns);
  return framed(message);
}

std::string jump_frame(const FeedState& state, const SmoothMap::Jump& jump, const std::string& why) {
  v1::Feed message;
  auto& out = *message.mutable_jump();
  out.set_stamp_ns(state.newest->stamp.ns);
  write(jump.from, *out.mutable_t_map_odom_from());
  write(jump.to, *out.mutable_t_map_odom_to());
  out.set_translation_m(jump.translation_m);
  out.set_rotation_rad(jump.rotation_rad);
  out.set_why(why.empty() ? fmt::format("proxy graph, epoch {}, revision {}", state.map_age.first, state.map_age.second)
                          : why);
  return framed(message);
}

std::string situation_frame(const FeedState& state) {
  v1::Feed message;
  auto& out = *message.mutable_situation();
  out.set_in_map(state.component.has_value());
  out.set_component(state.component.value_or(0));
  for (const TeamMate& mate : state.team_mates) {
    auto& to = *out.add_team_mate();
    to.set_robot(mate.robot.value);
    to.set_name(plain(mate.name));
    to.set_stamp_ns(mate.stamp.ns);
    to.set_same_component(mate.T_map_body.has_value());
    if (mate.T_map_body) write(*mate.T_map_body, *to.mutable_t_map_body());
  }
  for (const FeedAlert& alert : state.alerts) {
    auto& to = *out.add_alert();
    to.set_text(plain(alert.text));
    to.set_since_stamp_ns(alert.since.ns);
    to.set_from_stamp_ns(alert.from.ns);
    to.set_until_stamp_ns(alert.until.ns);
  }
  return framed(message);
}

std::string refused_frame(Timestamp stamp, const std::string& why) {
  v1::Feed message;
  message.mutable_refused()->set_stamp_ns(stamp.ns);
  message.mutable_refused()->set_why(plain(why));
  return framed(message);
}

std::string ended_frame() {
  v1::Feed message;
  message.mutable_ended();
  return framed(message);
}

std::string closed_frame(const std::string& why) {
  v1::Feed message;
  message.mutable_closed()->set_why(plain(why));
  return framed(message);
}

}  // namespace tutti::program
