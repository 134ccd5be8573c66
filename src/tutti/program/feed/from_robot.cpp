// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/from_robot.hpp"

#include <algorithm>

#include "tutti/v1/feed.pb.h"

namespace tutti::program {
namespace {

Pose3 pose(const v1::Feed::Pose& in) {
  return {Eigen::Quaterniond(in.qw(), in.qx(), in.qy(), in.qz()), {in.x(), in.y(), in.z()}};
}

FeedAnswer answer(const v1::Feed::Correction& in) {
  FeedAnswer out{.stamp = {in.stamp_ns()},
                 .wants_scan = in.wants_scan(),
                 .T_map_body = pose(in.t_map_body()),
                 .T_map_odom = pose(in.t_map_odom()),
                 .map_age = {in.map_epoch(), in.map_revision()},
                 .in_map = in.in_map()};
  for (int i = 0; i < std::min(36, in.t_map_odom_covariance_size()); ++i)
    out.covariance(i / 6, i % 6) = in.t_map_odom_covariance(i);
  return out;
}

FeedSituation situation(const v1::Feed::Situation& in) {
  FeedSituation out;
  for (const auto& alert : in.alert()) out.alerts.push_back(alert.text());
  for (const auto& value : in.status()) out.status.emplace_back(value.name(), value.text());
  return out;
}

FromRobot read(const v1::Feed& message) {
  switch (message.what_case()) {
    case v1::Feed::kWelcome:
      return FeedWelcome{};
    case v1::Feed::kCorrection:
      return answer(message.correction());
    case v1::Feed::kJump:
      return FeedJump{message.jump().translation_m(), message.jump().why()};
    case v1::Feed::kSituation:
      return situation(message.situation());
    case v1::Feed::kRefused:
      return FeedRefusal{{message.refused().stamp_ns()}, message.refused().why()};
    case v1::Feed::kRaw: {
      const auto& raw = message.raw();
      return FeedRaw{raw.topic(), raw.type(), raw.encoding(), raw.data()};
    }
    case v1::Feed::kNote:
      return FeedNote{message.note().text()};
    case v1::Feed::kClosed:
      return FeedOver{message.closed().why()};
    default:
      return FeedOther{};
  }
}

}  // namespace

Result<FromRobot> decode_from_robot(const std::string& payload) {
  v1::Feed message;
  if (!message.ParseFromString(payload)) return fail(ErrorCode::parse, "the robot says what is no message");
  return read(message);
}

}  // namespace tutti::program
