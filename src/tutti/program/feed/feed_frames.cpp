// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_frames.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "tutti/base/plain_text.hpp"
#include "tutti/program/feed/internal/feed_messages.hpp"

namespace tutti::program {
namespace {

using internal::framed;
using internal::kHeaderBytes;
using internal::write;

}  // namespace

std::int64_t client_stamp_ns(Timestamp stamp, std::int64_t offset_ns) {
  std::int64_t out = 0;
  if (!__builtin_sub_overflow(stamp.ns, offset_ns, &out)) return out;
  return offset_ns > 0 ? kFirstTimestamp.ns : kLastTimestamp.ns;
}

Result<std::optional<std::string>> FrameReader::take(std::string_view& bytes, std::size_t most) {
  const auto fill = [&](std::string& part, std::size_t size) {
    const std::size_t count = std::min(size - part.size(), bytes.size());
    part.append(bytes.substr(0, count));
    bytes.remove_prefix(count);
    return part.size() == size;
  };
  if (!fill(header_, kHeaderBytes)) return std::nullopt;
  std::size_t size = 0;
  for (std::size_t i = 0; i < kHeaderBytes; ++i) size |= std::size_t{static_cast<unsigned char>(header_[i])} << (8 * i);
  if (size == 0 || size > most) return fail(ErrorCode::parse, "a frame of {} bytes, expected 1 to {}", size, most);
  if (!fill(payload_, size)) return std::nullopt;
  header_.clear();
  return std::exchange(payload_, {});
}

std::string welcome_frame(const FeedState& state, const Pose3& T_map_odom, std::int64_t offset_ns) {
  v1::Feed message;
  auto& out = *message.mutable_welcome();
  out.set_protocol_version(kFeedVersion);
  out.set_robot_name(plain_text(state.name));
  out.set_robot(state.chain.robot.value);
  out.set_session(state.chain.session);
  out.set_has_odometry(state.newest.has_value());
  if (state.newest) out.set_last_stamp_ns(client_stamp_ns(state.newest->stamp, offset_ns));
  write(T_map_odom, *out.mutable_t_map_odom());
  for (const char* kind : kFromClient) out.add_takes(kind);
  out.set_clock_offset_ns(offset_ns);
  return framed(message);
}

std::string correction_frame(const FeedState& state, const SmoothMap::Answer& answer, std::uint64_t dropped,
                             std::int64_t offset_ns) {
  v1::Feed message;
  auto& out = *message.mutable_correction();
  out.set_stamp_ns(client_stamp_ns(state.newest->stamp, offset_ns));
  write(answer.T_map_odom * state.newest->pose, *out.mutable_t_map_body());
  write(answer.T_map_odom, *out.mutable_t_map_odom());
  for (const double x : answer.covariance.reshaped()) out.add_t_map_odom_covariance(x);
  out.set_map_epoch(state.map_age.first);
  out.set_map_revision(state.map_age.second);
  out.set_in_map(state.component.has_value());
  out.set_wants_scan(state.wants_scan);
  out.set_dropped(dropped);
  out.set_has_stored(state.stored.has_value());
  if (state.stored) out.set_stored_stamp_ns(client_stamp_ns(*state.stored, offset_ns));
  return framed(message);
}

std::string jump_frame(const FeedState& state, const SmoothMap::Jump& jump, std::int64_t offset_ns,
                       const std::string& why) {
  v1::Feed message;
  auto& out = *message.mutable_jump();
  out.set_stamp_ns(client_stamp_ns(state.newest->stamp, offset_ns));
  write(jump.from, *out.mutable_t_map_odom_from());
  write(jump.to, *out.mutable_t_map_odom_to());
  out.set_translation_m(jump.translation_m);
  out.set_rotation_rad(jump.rotation_rad);
  out.set_why(why.empty() ? fmt::format("proxy graph, epoch {}, revision {}", state.map_age.first, state.map_age.second)
                          : why);
  return framed(message);
}

std::string situation_frame(const FeedState& state, std::int64_t offset_ns) {
  v1::Feed message;
  auto& out = *message.mutable_situation();
  out.set_in_map(state.component.has_value());
  out.set_component(state.component.value_or(0));
  for (const TeamMate& mate : state.team_mates) {
    auto& to = *out.add_team_mate();
    to.set_robot(mate.robot.value);
    to.set_name(plain_text(mate.name));
    to.set_stamp_ns(mate.stamp.ns);
    to.set_same_component(mate.T_map_body.has_value());
    if (mate.T_map_body) write(*mate.T_map_body, *to.mutable_t_map_body());
  }
  for (const node::RobotAlert& alert : state.alerts) {
    auto& to = *out.add_alert();
    to.set_text(plain_text(alert.text));
    to.set_since_stamp_ns(client_stamp_ns(alert.since, offset_ns));
    to.set_from_stamp_ns(client_stamp_ns(alert.from, offset_ns));
    to.set_until_stamp_ns(client_stamp_ns(alert.until, offset_ns));
  }
  if (state.status)
    for (const auto& [name, text] : *state.status) {
      auto& to = *out.add_status();
      to.set_name(name);
      to.set_text(plain_text(text));
    }
  return framed(message);
}

std::string refused_frame(Timestamp stamp, const std::string& why, std::int64_t offset_ns) {
  v1::Feed message;
  message.mutable_refused()->set_stamp_ns(client_stamp_ns(stamp, offset_ns));
  message.mutable_refused()->set_why(plain_text(why));
  return framed(message);
}

std::string time_answer_frame(std::int64_t client_now_ns, Timestamp robot_now, std::int64_t offset_ns,
                              std::int64_t measured_ns, const std::optional<Timestamp>& stored) {
  v1::Feed message;
  auto& out = *message.mutable_time_answer();
  out.set_clock_now_ns(client_now_ns);
  out.set_robot_now_ns(robot_now.ns);
  out.set_clock_offset_ns(offset_ns);
  out.set_measured_offset_ns(measured_ns);
  out.set_has_stored(stored.has_value());
  if (stored) out.set_stored_stamp_ns(client_stamp_ns(*stored, offset_ns));
  return framed(message);
}

std::optional<std::string> trajectory_frame(const FeedTrajectory& trajectory, std::int64_t offset_ns) {
  constexpr std::size_t kMostBytesPerPose = 70;
  if ((trajectory.corrected.size() + trajectory.map.size() + 1) * kMostBytesPerPose > kMaxFeedBytes)
    return std::nullopt;
  v1::Feed message;
  auto& out = *message.mutable_trajectory();
  out.set_map_epoch(trajectory.map_age.first);
  out.set_map_revision(trajectory.map_age.second);
  out.set_constraints(trajectory.constraints);
  const auto add = [&](const Trajectory& poses, auto& stamps, auto& numbers) {
    for (const auto& [stamp, pose] : poses) {
      stamps.Add(client_stamp_ns(stamp, offset_ns));
      for (const double x : pose.translation) numbers.Add(x);
      for (const double x : pose.rotation.coeffs()) numbers.Add(x);  // x y z w
    }
  };
  add(trajectory.corrected, *out.mutable_stamp_ns(), *out.mutable_t_map_body());
  add(trajectory.map, *out.mutable_map_stamp_ns(), *out.mutable_t_world_body());
  return framed(message);
}

std::string raw_frame(const FeedRaw& raw) {
  v1::Feed message;
  auto& out = *message.mutable_raw();
  out.set_topic(raw.topic);
  out.set_type(raw.type);
  out.set_encoding(raw.encoding);
  out.set_data(raw.bytes);
  return framed(message);
}

std::string note_frame(const std::string& text) {
  v1::Feed message;
  message.mutable_note()->set_text(plain_text(text));
  return framed(message);
}

std::string ended_frame() {
  v1::Feed message;
  message.mutable_ended();
  return framed(message);
}

std::string closed_frame(const std::string& why) {
  v1::Feed message;
  message.mutable_closed()->set_why(plain_text(why));
  return framed(message);
}

}  // namespace tutti::program
