// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/live_feed.hpp"

#include <cmath>

namespace tutti::program {

Result<std::unique_ptr<LiveFeed>> LiveFeed::open(const std::string& socket, const FeedAccess& access,
                                                 mission::RobotActor& actor, Host& host, const Clock& clock,
                                                 RobotView view) {
  std::unique_ptr<LiveFeed> feed(new LiveFeed(actor, host, clock, std::move(view)));
  auto server = FeedServer::listen(socket, *feed, {}, access);
  if (!server) return tl::unexpected(server.error());
  feed->server_ = std::move(*server);
  return feed;
}

Status LiveFeed::add_odometry(const node::OdometrySample& sample) {
  actor_.add_odometry(sample, clock_.now());
  Status taken = carry_out();
  if (taken) ended_ = false;
  return taken;
}

Status LiveFeed::add_scan(const Scan& scan) {
  actor_.add_scan(scan, clock_.now());
  return carry_out();
}

Status LiveFeed::finish() {
  actor_.finish(clock_.now());
  Status taken = carry_out();
  ended_ = taken.has_value();
  return taken;
}

Status LiveFeed::carry_out() {
  node::Step step = actor_.take_step();
  note(step);
  const Status answer = taken(step);
  if (Status stored = host_.carry_out(std::move(step)); !stored) return stored;
  return answer;
}

void LiveFeed::note(const node::Step& step) {
  for (const node::Event& event : step.events) view_.note(event, actor_.node());
}

void LiveFeed::serve(double wall_s) { server_->serve(static_cast<int>(std::ceil(wall_s * 1e3))); }

}  // namespace tutti::program
