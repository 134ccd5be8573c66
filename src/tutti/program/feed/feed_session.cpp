// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/feed_session.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace tutti::program {

FeedSession::FeedSession(FeedTarget& target, const FeedSettings& settings)
    : target_(target),
      settings_(settings),
      map_(settings, target.state().T_map_odom),
      T_odom_fed_(target.state().T_odom_fed),
      situation_(situation_frame(target.state())) {}

void FeedSession::disconnect(Client client) {
  clients_.erase(client);
  if (feeder_ == client) feeder_.reset();
}

void FeedSession::receive(Client client, std::string_view bytes) {
  Connection& connection = clients_.at(client);
  while (!connection.over) {
    const auto payload = connection.reader.take(bytes);
    if (!payload) return close(client, payload.error().message);
    if (!*payload) return;
    const auto message = decode_from_client(**payload);
    if (!message) return close(client, message.error().message);
    take(client, *message);
  }
}

void FeedSession::take(Client client, const FromClient& message) {
  Connection& connection = clients_.at(client);
  if (const auto* hello = std::get_if<FeedHello>(&message)) return greet(client, *hello);
  if (!connection.greeted) return close(client, "expected Hello first of all");
  if (feeder_ != client) return close(client, "this client said that it only listens");
  if (const auto* bad = std::get_if<BadSample>(&message))
    put(connection, refused_frame(bad->stamp, bad->why));
  else if (const auto* sample = std::get_if<node::OdometrySample>(&message))
    take_odometry(client, *sample);
  else if (const auto* scan = std::get_if<Scan>(&message))
    take_scan(client, *scan);
  else if (const Status ok = target_.finish(); !ok)
    put(connection, refused_frame({}, ok.error().message));
  else {
    connection.ended = connection.waits_for_end = true;
    answer_end();
  }
}

void FeedSession::greet(Client client, const FeedHello& hello) {
  Connection& connection = clients_.at(client);
  if (connection.greeted) return close(client, "a second Hello");
  if (hello.version != kFeedVersion)
    return close(client,
                 fmt::format("protocol version {}, this program speaks version {}", hello.version, kFeedVersion));
  if (!hello.listens_only) {
    if (feeder_) return close(client, "another client feeds this robot already; listens_only may join it");
    feeder_ = client;
  }
  const auto listeners = std::ranges::count_if(clients_, [](const auto& other) { return other.second.listens_only; });
  if (hello.listens_only && listeners + 1 >= settings_.max_clients)
    return close(client, fmt::format("{} clients listen, no more may: one place is for who feeds", listeners));
  connection.listens_only = hello.listens_only;
  connection.greeted = true;
  const FeedState state = target_.state();
  put(connection, welcome_frame(state, map_.T_map_odom()));
  put(connection, situation_frame(state));
}

void FeedSession::take_odometry(Client client, const node::OdometrySample& sample) {
  Connection& connection = clients_.at(client);
  if (connection.ended) return put(connection, refused_frame(sample.stamp, "the recording has ended"));
  if (const Status ok = target_.add_odometry(sample); !ok)
    return put(connection, refused_frame(sample.stamp, ok.error().message));
  const FeedState state = target_.state();
  if (!(state.T_odom_fed == T_odom_fed_)) {
    const Pose3 before = std::exchange(T_odom_fed_, state.T_odom_fed);
    broadcast(jump_frame(state, map_.change_odom(before.inverse() * T_odom_fed_),
                         "odometry jumps: its front end began anew"));
  }
  const SmoothMap::Answer answer = map_.step(*state.newest, state.T_map_odom, state.covariance);
  if (answer.jump) broadcast(jump_frame(state, *answer.jump));
  for (auto& [number, listener] : clients_)
    if (listener.greeted) put(listener, correction_frame(state, answer, listener.dropped), true);
  refresh();
}

void FeedSession::take_scan(Client client, const Scan& scan) {
  Connection& connection = clients_.at(client);
  if (connection.ended) return put(connection, refused_frame(scan.stamp, "the recording has ended"));
  if (const Status ok = target_.add_scan(scan); !ok) put(connection, refused_frame(scan.stamp, ok.error().message));
}

void FeedSession::answer_end() {
  if (!target_.state().ended) return;
  for (auto& [number, connection] : clients_)
    if (std::exchange(connection.waits_for_end, false)) put(connection, ended_frame());
}

void FeedSession::refresh() {
  for (const FeedRefusal& refusal : target_.take_refusals())
    if (feeder_) put(clients_.at(*feeder_), refused_frame(refusal.stamp, refusal.why));
  answer_end();
  std::string now = situation_frame(target_.state());
  if (now == situation_) return;
  situation_ = std::move(now);
  broadcast(situation_);
}

void FeedSession::close(Client client, const std::string& why) {
  Connection& connection = clients_.at(client);
  put(connection, closed_frame(why));
  connection.over = true;
  if (feeder_ == client) feeder_.reset();
}

void FeedSession::broadcast(const std::string& frame) {
  for (auto& [number, connection] : clients_)
    if (connection.greeted) put(connection, frame);
}

void FeedSession::put(Connection& connection, std::string frame, bool is_correction) {
  if (connection.over) return;
  connection.queued += frame.size();
  connection.queue.push_back({std::move(frame), is_correction});
  make_room(connection);
}

void FeedSession::make_room(Connection& connection) {
  const std::size_t most = static_cast<std::size_t>(settings_.max_queue_kb) * 1024;
  // What has left in part must leave whole; the newest correction stays.
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
  if (connection.queued <= most) return;
  connection.queue.clear();
  connection.queued = connection.sent = 0;
  connection.over = true;
}

std::string_view FeedSession::output(Client client) const {
  const Connection& connection = clients_.at(client);
  return connection.queue.empty() ? std::string_view{}
                                  : std::string_view(connection.queue.front().bytes).substr(connection.sent);
}

void FeedSession::sent(Client client, std::size_t bytes) {
  Connection& connection = clients_.at(client);
  connection.sent += bytes;
  if (connection.queue.empty() || connection.sent < connection.queue.front().bytes.size()) return;
  connection.queued -= connection.queue.front().bytes.size();
  connection.queue.pop_front();
  connection.sent = 0;
}

}  // namespace tutti::program
