// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "tutti/mission/robot_actor.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/feed/feed_server.hpp"
#include "tutti/program/feed/robot_view.hpp"
#include "tutti/program/host.hpp"

namespace tutti::program {

/// The live feed of a hosted robot. What a client says goes to the robot, and what the robot says to that is carried
/// out by the host, before the client is answered. Once a step cannot be stored everything is refused: then the robot
/// goes, its feed with it, and whoever feeds comes again to both.
class LiveFeed final : public FeedTarget {
 public:
  /// FeedServer::listen(). All that it is given outlives it.
  static Result<std::unique_ptr<LiveFeed>> open(const std::string& socket, const FeedAccess& access,
                                                mission::RobotActor& actor, Host& host, const Clock& clock,
                                                RobotView view);

  Status add_odometry(const node::OdometrySample& sample) override;
  Status add_scan(const Scan& scan) override;
  Status finish() override;
  [[nodiscard]] FeedState state() const override { return view_.state(actor_.node()); }

  /// Of the robot's steps that come from elsewhere.
  void note(const node::Step& step);
  /// Waits at most so many wall seconds for clients, and answers them.
  void serve(double wall_s);
  /// The client said so, and has fed nothing since.
  [[nodiscard]] bool has_ended() const { return ended_; }
  [[nodiscard]] bool is_fed() const { return server_->session().has_feeder(); }

 private:
  LiveFeed(mission::RobotActor& actor, Host& host, const Clock& clock, RobotView view)
      : actor_(actor), host_(host), clock_(clock), view_(std::move(view)) {}
  Status carry_out();

  mission::RobotActor& actor_;
  Host& host_;
  const Clock& clock_;
  RobotView view_;
  bool ended_ = false;
  std::unique_ptr<FeedServer> server_;
};

}  // namespace tutti::program
