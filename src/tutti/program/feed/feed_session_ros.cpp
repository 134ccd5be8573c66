// SPDX-License-Identifier: BSD-3-Clause
// A client that feeds raw messages of ROS.
#include <utility>

#include "tutti/program/feed/feed_session.hpp"

namespace tutti::program {

Timestamp FeedSession::by_client(Timestamp stamp) const { return {client_stamp_ns(stamp, last_.clock.offset_ns())}; }

FeedState FeedSession::state() const {
  FeedState out = target_.state();
  if (!ros_ || ros_->intake().missing().empty()) return out;
  const Timestamp now = out.newest ? out.newest->stamp : Timestamp{};
  out.alerts.push_back({ros_->intake().missing(), now, now, now});
  return out;
}

/// Cameras of raw messages are known only once these have come: until then those of the client before count, if it
/// named the same topics.
Status FeedSession::begin_ros(const FeedHello& hello) {
  if (!hello.ros) return tl::unexpected(hello.ros.error());
  ros_.reset();
  const auto before = std::exchange(sensors_of_, *hello.ros);
  if (*hello.ros) {
    const FeedState state = target_.state();
    auto made = RosClient::make(of_mission_, **hello.ros,
                                state.newest ? std::optional(by_client(state.newest->stamp)) : std::nullopt);
    if (!made) return tl::unexpected(made.error());
    ros_ = std::move(*made);
    if (before && ros_->has_sensors_of(*before) && sensors_.scans == hello.sensors->scans) return {};
  }
  sensors_ = *hello.sensors;
  return {};
}

void FeedSession::take_raw(Client client, const intake::RawMessage& raw) {
  Connection& connection = clients_.at(client);
  const auto refuse_raw = [&](const std::string& why) { put(connection, refused_frame({}, why, 0)); };
  if (!ros_) return refuse_raw("a raw message, which Hello does not announce (Hello.ros)");
  if (raw.type == RosClient::kPathType) {
    if (const auto path = ros_->path()) put(connection, raw_frame(*path), true);
    return;
  }
  if (const Status taken = ros_->add(raw); !taken) refuse_raw(taken.error().message);
  take_due(client);
}

void FeedSession::take_due(Client client) {
  Connection& connection = clients_.at(client);
  if (const Sensors& known = ros_->intake().sensors(); !known.cameras.empty()) {
    const bool scans = sensors_.scans;
    if (Sensors now = known; now.scans = scans, now != sensors_) target_.set_sensors(sensors_ = std::move(now));
  }
  while (!connection.over) {
    auto input = ros_->next();
    if (!input) {
      put(connection, refused_frame({}, input.error().message, 0));
      continue;
    }
    if (!*input) break;
    take_fed(client, std::move(**input));
  }
  for (const std::string& note : ros_->intake().take_notes()) put(connection, note_frame(note));
}

void FeedSession::send_to_ros(Client client, const FeedState& state, const SmoothMap::Answer& answer) {
  const FeedAnswer for_client{.stamp = by_client(state.newest->stamp),
                              .wants_scan = state.wants_scan,
                              .T_map_body = answer.T_map_odom * state.newest->pose,
                              .T_map_odom = answer.T_map_odom,
                              .covariance = answer.covariance,
                              .map_age = state.map_age,
                              .in_map = state.component.has_value()};
  for (const FeedRaw& raw : ros_->hear(for_client, state.newest->pose)) put(clients_.at(client), raw_frame(raw), true);
}

void FeedSession::send_to_ros(FeedTrajectory trajectory) {
  for (StampedPose& at : trajectory.corrected) at.stamp = by_client(at.stamp);
  ros_->hear(trajectory);
}

}  // namespace tutti::program
