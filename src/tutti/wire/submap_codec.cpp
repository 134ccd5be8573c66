// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tutti/v1/messages.pb.h"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/field_columns.hpp"
#include "tutti/wire/frame.hpp"
#include "tutti/wire/internal/cloud_codec.hpp"
#include "tutti/wire/internal/columns.hpp"
#include "tutti/wire/internal/payload.hpp"
#include "tutti/wire/internal/quantise.hpp"
#include "tutti/wire/internal/visual_codec.hpp"
#include "tutti/wire/limits.hpp"
#include "tutti/wire/submap_outline.hpp"

namespace tutti::wire {
namespace {

constexpr double kSameOdometry = 1e-7;  // m and rad: far below the rounding of the poses

Pose3 odometry_from_poses(const Submap& submap, std::size_t k) {
  return submap.keyframes[k].T_odom_body.inverse() * submap.keyframes[k + 1].T_odom_body;
}

bool odometry_follows_from_poses(const Submap& submap) {
  for (std::size_t k = 0; k < submap.odometry.size(); ++k)
    if (local(odometry_from_poses(submap, k), submap.odometry[k].T_a_b).norm() > kSameOdometry) return false;
  return true;
}

void write_odometry(const Submap& submap, v1::Submap& out) {
  std::vector<CovarianceCode> covariances;
  std::vector<PoseCode> poses;
  for (const RelativePose& odometry : submap.odometry) {
    covariances.push_back(quantise(odometry.covariance, kKeyframeCovarianceSteps));
    poses.push_back(quantise(odometry.T_a_b, kKeyframePoseSteps));
  }
  write_columns(covariances, *out.mutable_odometry_covariance());
  if (!odometry_follows_from_poses(submap)) write_columns(poses, *out.mutable_odometry());
}

Status read_keyframes(const v1::Submap& in, Submap& submap) {
  const auto count = static_cast<std::size_t>(in.stamp_ns_size());
  if (count == 0) return fail(ErrorCode::invalid, "no keyframes, expected at least one");
  const auto stamps = read_columns<1>(in.stamp_ns(), count);
  const auto poses = read_columns<6>(in.pose(), count);
  if (!poses || static_cast<std::size_t>(in.representative_size()) != count)
    return fail(ErrorCode::parse, "{} pose numbers and {} flags for {} keyframes", in.pose_size(),
                in.representative_size(), count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::optional<Pose3> T_odom_body = dequantise((*poses)[k], kKeyframePoseSteps);
    if (!T_odom_body) return fail(ErrorCode::invalid, "pose {} is out of range", k);
    submap.keyframes.push_back({in.first_keyframe() + static_cast<std::uint32_t>(k), Timestamp{(*stamps)[k][0]},
                                *T_odom_body, in.representative(static_cast<int>(k))});
  }
  return {};
}

Status read_odometry(const v1::Submap& in, Submap& submap) {
  const std::size_t count = submap.keyframes.size() - 1;
  const auto covariances = read_columns<21>(in.odometry_covariance(), count);
  if (!covariances)
    return fail(ErrorCode::parse, "{} covariance numbers for {} odometry factors", in.odometry_covariance_size(),
                count);
  const bool follows = in.odometry_size() == 0;
  const auto poses = read_columns<6>(in.odometry(), follows ? 0 : count);
  if (!poses) return fail(ErrorCode::parse, "{} pose numbers for {} odometry factors", in.odometry_size(), count);
  for (std::size_t k = 0; k < count; ++k) {
    const std::optional<Pose3> T =
        follows ? odometry_from_poses(submap, k) : dequantise((*poses)[k], kKeyframePoseSteps);
    const std::optional<Matrix6d> covariance = dequantise((*covariances)[k], kKeyframeCovarianceSteps);
    if (!T || !covariance) return fail(ErrorCode::invalid, "odometry factor {} is out of range", k);
    submap.odometry.push_back({*T, *covariance});
  }
  return {};
}

// Divided by, not multiplied with, so that 90 degrees come back as 90.
constexpr double kFixAnglesPerDegree = 1e9;  // 0.1 mm on the ground
constexpr double kFixHeightsPerMetre = 1e4;

void write_fixes(const Submap& submap, v1::Fixes& out) {
  std::vector<std::array<std::int64_t, 1>> keyframes;
  std::vector<std::array<std::int64_t, 3>> positions;
  for (const SubmapFix& fix : submap.fixes) {
    keyframes.push_back({std::int64_t{fix.keyframe} - submap.keyframes.front().index});
    positions.push_back({std::llround(fix.antenna.latitude_deg * kFixAnglesPerDegree),
                         std::llround(fix.antenna.longitude_deg * kFixAnglesPerDegree),
                         std::llround(fix.antenna.height_m * kFixHeightsPerMetre)});
    for (const double x : fix.p_keyframe_antenna) out.add_antenna(static_cast<float>(x));
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column <= row; ++column) out.add_covariance(static_cast<float>(fix.covariance(row, column)));
  }
  write_columns(keyframes, *out.mutable_keyframe());
  write_columns(positions, *out.mutable_position());
}

/// Checks how many there are before memory is taken for them; their values are checked with the message.
Status read_fixes(const v1::Fixes& in, Submap& submap) {
  const auto count = static_cast<std::size_t>(in.keyframe_size());
  if (count > kMaxFixes) return fail(ErrorCode::invalid, "{} fixes, at most {} are accepted", count, kMaxFixes);
  const auto keyframes = read_columns<1>(in.keyframe(), count);
  const auto positions = read_columns<3>(in.position(), count);
  if (!keyframes || !positions || static_cast<std::size_t>(in.antenna_size()) != 3 * count ||
      static_cast<std::size_t>(in.covariance_size()) != 6 * count)
    return fail(ErrorCode::parse, "{} numbers of positions, {} of antennas and {} of covariances for {} fixes",
                in.position_size(), in.antenna_size(), in.covariance_size(), count);
  const std::int64_t first = submap.keyframes.front().index;
  for (std::size_t i = 0; i < count; ++i) {
    const std::int64_t offset = (*keyframes)[i][0];
    if (offset < 0 || offset >= std::ssize(submap.keyframes))
      return fail(ErrorCode::invalid, "fix {} is at keyframe {} of {}", i, offset, submap.keyframes.size());
    SubmapFix fix{.keyframe = static_cast<std::uint32_t>(first + offset)};
    const auto& [latitude, longitude, height] = (*positions)[i];
    fix.antenna = {static_cast<double>(latitude) / kFixAnglesPerDegree,
                   static_cast<double>(longitude) / kFixAnglesPerDegree,
                   static_cast<double>(height) / kFixHeightsPerMetre};
    int antenna = 3 * static_cast<int>(i), covariance = 6 * static_cast<int>(i);
    for (double& x : fix.p_keyframe_antenna) x = in.antenna(antenna++);
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column <= row; ++column)
        fix.covariance(row, column) = fix.covariance(column, row) = in.covariance(covariance++);
    submap.fixes.push_back(fix);
  }
  return {};
}

std::string ranges_bytes(const std::vector<RobotRange>& ranges) {
  FieldColumnWriter columns(0);
  for (const RobotRange& range : ranges) visit_fields(range, columns);
  std::string out;
  columns.finish(out);
  return out;
}

/// Checks how many there are; their values are checked with the message.
Status read_ranges(const std::string& bytes, std::vector<RobotRange>& ranges) {
  const auto fields = split_fields(bytes);
  if (!fields) return tl::unexpected(fields.error());
  return FieldColumnReader(*fields, 0, kMaxRanges).read(ranges);
}

/// All but the payloads.
Result<SubmapMessage> read_trajectory_message(const v1::Submap& in) {
  SubmapMessage message;
  const ChainId chain{RobotId{in.header().robot()}, in.header().session()};
  message.header = {chain.robot, chain.session, in.header().sequence()};
  message.submap.id = {chain, in.index()};
  const std::string where = "submap " + to_string(message.submap.id);
  if (auto ok = read_keyframes(in, message.submap); !ok) return in_context(where, ok.error());
  if (auto ok = read_odometry(in, message.submap); !ok) return in_context(where, ok.error());
  if (auto ok = read_fixes(in.fixes(), message.submap); !ok) return in_context(where, ok.error());
  if (auto ok = read_ranges(in.ranges().SerializeAsString(), message.submap.ranges); !ok)
    return in_context(where + ": ranges", ok.error());
  return message;
}

/// The payloads, or their sizes.
template <class CloudPart, class VisualPart>
Status read_payloads(const v1::Submap& in, CloudPart& cloud, VisualPart& visual) {
  if (cloud.ParseFromString(in.cloud()) && visual.ParseFromString(in.visual())) return {};
  return fail(ErrorCode::parse, "its payloads are not the messages expected");
}

}  // namespace

std::string encode(const SubmapMessage& message, const CloudCodec& cloud) {
  expect_valid(validate(message));
  const Submap& submap = message.submap;
  v1::Submap out;
  out.mutable_header()->set_robot(message.header.robot.value);
  out.mutable_header()->set_session(message.header.session);
  out.mutable_header()->set_sequence(message.header.sequence);
  out.set_index(submap.id.index);
  out.set_first_keyframe(submap.keyframes.front().index);
  std::vector<std::array<std::int64_t, 1>> stamps;
  std::vector<PoseCode> poses;
  for (const Keyframe& keyframe : submap.keyframes) {
    stamps.push_back({keyframe.stamp.ns});
    poses.push_back(quantise(keyframe.T_odom_body, kKeyframePoseSteps));
    out.add_representative(keyframe.representative);
  }
  write_columns(stamps, *out.mutable_stamp_ns());
  write_columns(poses, *out.mutable_pose());
  write_odometry(submap, out);
  if (!submap.fixes.empty()) write_fixes(submap, *out.mutable_fixes());
  if (!submap.ranges.empty()) TUTTI_CHECK(out.mutable_ranges()->ParseFromString(ranges_bytes(submap.ranges)), "ranges");
  if (submap.cloud && !submap.cloud->points.empty()) {
    v1::Cloud payload;
    encode_cloud(*submap.cloud, cloud, payload);
    out.set_cloud(payload.SerializeAsString());
  }
  if (submap.visual) {
    v1::Visual payload;
    encode_visual(*submap.visual, submap.keyframes.front().index, payload);
    out.set_visual(payload.SerializeAsString());
  }
  return pack_frame(MessageKind::submap, out.SerializeAsString());
}

Result<SubmapMessage> decode_submap(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Submap>(MessageKind::submap, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  const v1::Submap& in = *parsed;
  auto trajectory = read_trajectory_message(in);
  if (!trajectory) return trajectory;
  SubmapMessage message = std::move(*trajectory);
  const std::string where = "submap " + to_string(message.submap.id);
  v1::Cloud cloud_in;
  v1::Visual visual_in;
  if (auto ok = read_payloads(in, cloud_in, visual_in); !ok) return in_context(where, ok.error());
  if (cloud_in.voxel_size() > 0) {
    auto cloud = decode_cloud(cloud_in);
    if (!cloud) return in_context(where, cloud.error());
    message.submap.cloud = std::move(*cloud);
  }
  if (in.has_visual()) {
    auto visual = decode_visual(visual_in, in.first_keyframe());
    if (!visual) return in_context(where, visual.error());
    message.submap.visual = std::move(*visual);
  }
  if (auto ok = validate(message); !ok) return tl::unexpected(ok.error());
  return message;
}

Result<SubmapOutline> decode_outline(std::string_view bytes) {
  const auto parsed = parse_frame<v1::Submap>(MessageKind::submap, bytes);
  if (!parsed) return tl::unexpected(parsed.error());
  auto trajectory = read_trajectory_message(*parsed);
  if (!trajectory) return tl::unexpected(trajectory.error());
  if (auto ok = validate(*trajectory); !ok) return tl::unexpected(ok.error());
  SubmapOutline outline{std::move(trajectory->submap), {}};
  v1::CloudSize cloud;
  v1::VisualSize visual;
  if (auto ok = read_payloads(*parsed, cloud, visual); !ok)
    return in_context("submap " + to_string(outline.submap.id), ok.error());
  outline.size = {cloud.offset_x().size(), visual.observations()};
  return outline;
}

}  // namespace tutti::wire
