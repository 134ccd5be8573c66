// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/feed/local_client.hpp"

#include <utility>

namespace tutti::program {

Result<std::unique_ptr<LocalClient>> LocalClient::join(LiveFeed& feed, const FeedHello& hello) {
  std::unique_ptr<LocalClient> out(new LocalClient(feed));
  const bool is_taken = feed.use(out->server_, [&](FeedServer& server) {
    out->client_ = server.join();
    server.session().say(out->client_, hello);
  });
  if (!is_taken) return fail(ErrorCode::io, "the live feed takes no clients just now");
  return out;
}

LocalClient::~LocalClient() {
  if (server_ == 0) return;  // it never joined
  feed_.use(server_, [&](FeedServer& server) { server.session().disconnect(client_); });
}

void LocalClient::use(const std::function<void(FeedSession&)>& work) {
  if (has_ended_) return;
  const bool is_there = feed_.use(server_, [&](FeedServer& server) {
    if (!server.session().is_over(client_)) work(server.session());
  });
  has_ended_ = !is_there;
}

void LocalClient::say(const intake::RawMessage& message) {
  use([&](FeedSession& session) { session.say(client_, message); });
}

void LocalClient::say(FeedEnd end) {
  use([&](FeedSession& session) { session.say(client_, end); });
}

void LocalClient::use_intake(const std::function<void(intake::SensorIntake&)>& work) {
  use([&](FeedSession& session) {
    if (session.ros() == nullptr) return;
    work(session.ros()->intake());
    session.take_due(client_);
  });
}

Result<std::vector<FromRobot>> LocalClient::hear() {
  if (has_ended_) return fail(ErrorCode::io, "the live feed has ended the connection");
  std::string bytes;
  const bool is_there = feed_.use(server_, [&](FeedServer& server) {
    FeedSession& session = server.session();
    for (std::string_view some = session.output(client_); !some.empty(); some = session.output(client_)) {
      bytes += some;
      session.sent(client_, some.size());
    }
    has_ended_ = session.is_over(client_);
  });
  has_ended_ = has_ended_ || !is_there;
  std::vector<FromRobot> out;
  FrameReader reader;
  for (std::string_view left = bytes; !left.empty();) {
    const auto payload = reader.take(left);  // whole frames of our own
    auto message = decode_from_robot(payload.value().value());
    if (!message) return tl::unexpected(message.error());
    out.push_back(std::move(*message));
  }
  return out;
}

}  // namespace tutti::program
