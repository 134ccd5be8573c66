// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>

#include "tutti/drive/driver.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/fed_camera.hpp"
#include "tutti/program/feed/feed_front.hpp"
#include "tutti/program/feed/robot_view.hpp"
#include "tutti/program/host.hpp"

namespace tutti::program {

/// The robot's end of a live feed: takes the inputs that wait at the front, in order; lets the host carry out the steps
/// that the robot makes of them; and reports to the front what the robot knows. It is destroyed with its node, while
/// the front stays: inputs that the front still has go to the next node.
class FedRobot {
 public:
  static constexpr double kLongest_s = 0.05;  ///< Longest work at a time, unless one input takes longer.
  static constexpr double kPublish_s = 0.05;  ///< The front gets news at least this often while the robot is behind.

  /// All arguments must outlive it.
  FedRobot(FeedFront& front, drive::Driver& robot, Host& host, const Clock& clock, RobotView view,
           const visual::TrackerConfig& tracker = {})
      : front_(front), robot_(robot), host_(host), clock_(clock), view_(std::move(view)), camera_(tracker) {
    expect(*front_.sensors());
    front_.begin_again(robot_.node().agent().newest_sample());
  }

  /// Notes a step that the robot made of other input, such as messages.
  void note(const node::Step& step);
  /// Waits at most `wall_s` wall seconds for inputs, and takes them. Earlier steps must be carried out before.
  void wait(double wall_s);
  /// Takes everything that was fed until now; the front accepts nothing more.
  void end();

 private:
  /// False when the input cannot be stored, and the robot is destroyed.
  bool take(const FeedInput& input);
  void hear(const Input& input, Timestamp now);
  void see(const EncodedImages& images, Timestamp now);
  void hear(const std::shared_ptr<const Sensors>& sensors, Timestamp /*now*/) { expect(*sensors); }
  void hear(FeedEnded, Timestamp now) { robot_.finish(now); }
  void hear(const FeedAnew& anew, Timestamp now) { robot_.begin_session(anew.why, now); }
  void expect(const Sensors& sensors) { robot_.expect_sensors(sensors.scans, !sensors.cameras.empty()); }
  void publish();

  FeedFront& front_;
  drive::Driver& robot_;
  Host& host_;
  const Clock& clock_;
  RobotView view_;
  FedCamera camera_;
  double publish_s_ = 0.0;
};

}  // namespace tutti::program
