// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_session.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <utility>

namespace tutti::program {

namespace {

/// The situation as compared with every sample: FeedState::status changes by itself, and takes longer to write.
std::string without_status(FeedState state) {
  state.status.reset();
  return situation_frame(state, 0);
}

}  // namespace

FeedSession::FeedSession(FeedTarget& target, const FeedSettings& settings, Now now, intake::SensorConfig sensors)
    : target_(target),
      settings_(settings),
      map_(settings, target.state().T_map_odom),
      T_odom_fed_(target.state().T_odom_fed),
      situation_(without_status(target.state())),
      now_(std::move(now)),
      of_mission_(std::move(sensors)) {}

void FeedSession::disconnect(Client client) {
  clients_.erase(client);
  if (feeder_ != client) return;
  feeder_.reset();
  ros_.reset();
}

void FeedSession::receive(Client client, std::string_view bytes) {
  Connection& connection = clients_.at(client);
  connection.moved = true;
  if (feeder_ == client) last_.bytes += bytes.size();
  while (!connection.over) {
    const bool feeds = feeder_ == client;
    const auto payload = connection.reader.take(bytes, feeds ? kMaxFeedBytes : kMaxHelloBytes);
    if (!payload) return close(client, payload.error().message + (feeds ? "" : " of a client that does not feed"));
    if (!*payload) return;
    auto message = decode_from_client(**payload);
    if (!message) return close(client, message.error().message);
    take(client, std::move(*message));
  }
}

void FeedSession::take(Client client, FromClient message) {
  Connection& connection = clients_.at(client);
  if (const auto* hello = std::get_if<FeedHello>(&message)) return greet(client, *hello);
  if (!connection.greeted) return close(client, "expected Hello first of all");
  if (const auto* unknown = std::get_if<FeedUnknown>(&message)) {
    const std::string why = fmt::format("a message of number {}, which this robot does not know; it takes {}",
                                        unknown->number, fmt::join(kFromClient, ", "));
    return put(connection, refused_frame({}, why, 0));
  }
  if (feeder_ != client) return close(client, "this client announced that it only listens");
  if (const auto* bad = std::get_if<BadSample>(&message))
    return put(connection, refused_frame(bad->stamp, bad->why, 0));  // by its own clock
  if (const auto* time = std::get_if<FeedTime>(&message)) return take_time(client, *time);
  if (const auto* raw = std::get_if<FeedRaw>(&message))
    return take_raw(client, {raw->topic, raw->type, raw->encoding, raw->bytes});
  if (auto* input = std::get_if<Input>(&message)) return take_fed(client, std::move(*input));
  if (ros_) ros_->intake().end(), take_due(client);
  if (const Status ok = target_.finish(); !ok) return put(connection, refused_frame({}, ok.error().message, 0));
  connection.ended = connection.waits_for_end = true;
  answer_end();
}

void FeedSession::take_fed(Client client, Input input) {
  Connection& connection = clients_.at(client);
  std::optional<Timestamp> wrong;
  for_each_stamp(input, [&](Timestamp& stamp) {
    const auto moved = last_.clock.to_robot(stamp);
    if (!moved && !wrong) wrong = stamp;
    stamp = moved.value_or(stamp);
  });
  if (wrong)
    return put(
        connection,
        refused_frame(
            *wrong, fmt::format("with the clock's offset of {} ns there is no such time", last_.clock.offset_ns()), 0));
  const Timestamp stamp = stamp_of(input);
  const bool is_odometry = std::holds_alternative<OdometrySample>(input);
  if (connection.ended && !std::holds_alternative<Health>(input))
    return refuse(client, stamp, "the recording has ended");
  const Status taken = target_.add(std::move(input));
  if (!taken) refuse(client, stamp, taken.error().message);
  if (is_odometry && taken) return answer(client);
  if (is_odometry) refresh();  // many in a row are an alert
}

void FeedSession::take_time(Client client, const FeedTime& time) {
  const Timestamp now = now_();
  const auto measured_ns = last_.clock.check(time.clock_now_ns, now);
  if (!measured_ns)
    return put(clients_.at(client),
               refused_frame({time.clock_now_ns}, "a clock that is farther from the robot's than 64 bits hold", 0));
  put(clients_.at(client),
      time_answer_frame(time.clock_now_ns, now, last_.clock.offset_ns(), *measured_ns, target_.state().stored));
}

void FeedSession::refuse(Client client, Timestamp stamp, const std::string& why) {
  put(clients_.at(client), refused_frame(stamp, why, offset_ns(client)));
}

void FeedSession::greet(Client client, const FeedHello& hello) {
  Connection& connection = clients_.at(client);
  if (connection.greeted) return close(client, "a second Hello");
  if (hello.version != kFeedVersion)
    return close(client,
                 fmt::format("protocol version {}, this program speaks version {}", hello.version, kFeedVersion));
  if (!hello.listens_only) {
    if (feeder_) return close(client, "another client feeds this robot already; listens_only may join it");
    if (!hello.sensors) return close(client, "sensors: " + hello.sensors.error().message);
    if (!last_.clock.begin(hello.clock_offset_ns, hello.clock_now_ns, now_()))
      return close(client, "a clock that is farther from the robot's than 64 bits hold");
    if (const Status ok = begin_ros(hello); !ok) return close(client, "ros: " + ok.error().message);
    last_.name = hello.client;
    feeder_ = client;
    target_.set_sensors(sensors_);
  }
  const auto listeners = std::ranges::count_if(clients_, [](const auto& other) { return other.second.listens_only; });
  if (hello.listens_only && listeners + 1 >= settings_.max_clients)
    return close(client, fmt::format("{} clients listen, no more may: one place is for who feeds", listeners));
  connection.listens_only = hello.listens_only;
  connection.greeted = true;
  connection.wants_trajectory = hello.wants_trajectory;
  if (hello.wants_trajectory || (feeder_ == client && ros_)) target_.want_trajectory();
  const FeedState state = this->state();
  put(connection, welcome_frame(state, map_.T_map_odom(), offset_ns(client)));
  put(connection, situation_frame(state, offset_ns(client)));
}

void FeedSession::answer(Client client) {
  const FeedState state = target_.state();
  if (!(state.T_odom_fed == T_odom_fed_)) {
    const Pose3 before = std::exchange(T_odom_fed_, state.T_odom_fed);
    const SmoothMap::Jump jump = map_.change_odom(before.inverse() * T_odom_fed_);
    broadcast([&](std::int64_t offset_ns) {
      return jump_frame(state, jump, offset_ns, "odometry jumps: its front end began anew");
    });
  }
  const SmoothMap::Answer answer = map_.step(*state.newest, state.T_map_odom, state.covariance);
  if (answer.jump) broadcast([&](std::int64_t offset_ns) { return jump_frame(state, *answer.jump, offset_ns); });
  for (auto& [number, listener] : clients_)
    if (listener.greeted) put(listener, correction_frame(state, answer, listener.dropped, offset_ns(number)), true);
  if (ros_) send_to_ros(client, state, answer);
  refresh();
}

void FeedSession::answer_end() {
  if (!target_.state().ended) return;
  for (auto& [number, connection] : clients_)
    if (std::exchange(connection.waits_for_end, false)) put(connection, ended_frame());
}

void FeedSession::refresh() {
  for (const FeedRefusal& refusal : target_.take_refusals())
    if (feeder_) refuse(*feeder_, refusal.stamp, refusal.why);
  answer_end();
  for (const FeedTrajectory& trajectory : target_.take_trajectories()) {
    if (ros_) send_to_ros(trajectory);
    for (auto& [number, listener] : clients_)
      if (listener.wants_trajectory)
        if (auto frame = trajectory_frame(trajectory, offset_ns(number))) put(listener, std::move(*frame), true);
  }
  const FeedState state = this->state();
  if (ros_)
    for (const FeedRaw& raw : ros_->hear(state, by_client(state.located))) put(clients_.at(*feeder_), raw_frame(raw));
  std::string now = without_status(state);
  if (now == situation_ && state.status == status_) return;
  situation_ = std::move(now);
  status_ = state.status;
  broadcast([&](std::int64_t offset_ns) { return situation_frame(state, offset_ns); });
}

void FeedSession::close(Client client, const std::string& why) {
  Connection& connection = clients_.at(client);
  put(connection, closed_frame(why));
  connection.over = true;
  connection.reader = {};
  if (feeder_ == client) feeder_.reset();
}

void FeedSession::close_stalled(double wall_s) {
  for (auto& [number, connection] : clients_) {
    const bool waits = connection.over ? !connection.queue.empty() : connection.reader.is_within_frame();
    if (std::exchange(connection.moved, false) || !waits) connection.moved_s = wall_s;
    if (wall_s - connection.moved_s <= kMostPause_s) continue;
    connection.moved_s = wall_s;
    if (connection.over)
      drop_queue(connection);
    else
      close(number, fmt::format("a frame has begun, and nothing came of it for {} s", kMostPause_s));
  }
}

void FeedSession::broadcast(const std::function<std::string(std::int64_t offset_ns)>& frame) {
  for (auto& [number, connection] : clients_)
    if (connection.greeted) put(connection, frame(offset_ns(number)));
}

void FeedSession::put(Connection& connection, std::string frame, bool is_correction) {
  if (connection.over) return;
  connection.queued += frame.size();
  connection.queue.push_back({std::move(frame), is_correction});
  make_room(connection);
}

void FeedSession::make_room(Connection& connection) {
  const std::size_t most = static_cast<std::size_t>(settings_.max_queue_kb) * 1024;
  // A frame sent in part must be sent whole; the newest correction stays.
  std::size_t at = connection.sent > 0 ? 1 : 0;
  while (connection.queued > most && at + 1 < connection.queue.size()) {
    if (!connection.queue[at].is_correction) {
      ++at;
      continue;
    }
    connection.queued -= connection.queue[at].bytes.size();
    connection.queue.erase(connection.queue.begin() + static_cast<std::ptrdiff_t>(at));
    ++connection.dropped;
  }
  const Frame& newest = connection.queue.back();
  if (connection.queued - (newest.is_correction ? newest.bytes.size() : 0) <= most) return;
  drop_queue(connection);
  connection.over = true;
  connection.reader = {};
}

void FeedSession::drop_queue(Connection& connection) {
  connection.queue.clear();
  connection.queued = connection.sent = 0;
}

std::string_view FeedSession::output(Client client) const {
  const Connection& connection = clients_.at(client);
  return connection.queue.empty() ? std::string_view{}
                                  : std::string_view(connection.queue.front().bytes).substr(connection.sent);
}

void FeedSession::sent(Client client, std::size_t bytes) {
  Connection& connection = clients_.at(client);
  connection.sent += bytes;
  connection.moved = true;
  if (connection.queue.empty() || connection.sent < connection.queue.front().bytes.size()) return;
  connection.queued -= connection.queue.front().bytes.size();
  connection.queue.pop_front();
  connection.sent = 0;
}

}  // namespace tutti::program
