// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>

#include "tutti/program/clock.hpp"
#include "tutti/program/fed_camera.hpp"
#include "tutti/program/feed/feed_front.hpp"
#include "tutti/program/feed/robot_view.hpp"
#include "tutti/program/host.hpp"
#include "tutti/program/robot_driver.hpp"

namespace tutti::program {

/// The robot's end of a live feed: takes what waits at the front in its order, lets the host carry out what the robot
/// says to it, and tells the front what the robot knows. It goes with its node; the front stays, and what it still
/// holds comes to the next one.
class FedRobot {
 public:
  static constexpr double kLongest_s = 0.05;  ///< Of work at a time, unless one input takes longer.
  static constexpr double kPublish_s = 0.05;  ///< At least so often, while it is behind.

  /// All that it is given outlives it.
  FedRobot(FeedFront& front, LiveRobot& robot, Host& host, const Clock& clock, RobotView view,
           const visual::TrackerConfig& tracker = {})
      : front_(front), robot_(robot), host_(host), clock_(clock), view_(std::move(view)), camera_(tracker) {
    expect(*front_.sensors());
    front_.begin_again(robot_.node().agent().newest_sample());
  }

  /// Of the robot's steps that come from elsewhere.
  void note(const node::Step& step);
  /// Waits at most so many wall seconds for what is fed, and takes it. All steps of before are carried out.
  void wait(double wall_s);
  /// Takes what has come until now, and clients nothing more.
  void end();

 private:
  /// False: it cannot be stored, and the robot goes.
  bool take(const FeedInput& input);
  void hear(const node::OdometrySample& sample, Timestamp now) { robot_.add_odometry(sample, now); }
  void hear(const Scan& scan, Timestamp now);
  void hear(const FedImages& images, Timestamp now);
  void hear(const std::shared_ptr<const FeedSensors>& sensors, Timestamp /*now*/) { expect(*sensors); }
  void hear(FeedEnded, Timestamp now) { robot_.finish(now); }
  void expect(const FeedSensors& sensors) { robot_.expect_sensors(sensors.scans, !sensors.cameras.empty()); }
  void tell_image_errors(Timestamp stamp, Timestamp now);
  void publish();

  FeedFront& front_;
  LiveRobot& robot_;
  Host& host_;
  const Clock& clock_;
  RobotView view_;
  FedCamera camera_;
  bool images_fail_ = false;  // the last ones
  double publish_s_ = 0.0;
};

}  // namespace tutti::program
