// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <vector>

#include "tutti/drive/driver.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::drive {

/// The settings of an agent that replays a recording: `config`, with the sensors that the recording has.
robot::AgentConfig with_sensors(robot::AgentConfig config, const Recording& recording);

/// How many odometry samples of its recording a robot has heard, from the first.
std::size_t heard_samples(const Recording& recording, const robot::RobotAgent& agent);

/// Feeds a robot its recording, in the order of stamps: each odometry sample, and then what its sensors measured until
/// there. It goes on where the robot stands, also after a kill.
class Replay {
 public:
  /// `start_s`: the mission time of the first sample. All arguments must outlive it.
  Replay(const Recording& recording, double start_s, Driver& driver);

  /// To be called first: the robot's first step, with what may not have been stored before a kill.
  void resume(Timestamp now);
  /// Mission time of the next odometry sample, s; infinity when none is left.
  [[nodiscard]] double next_time() const;
  [[nodiscard]] OdometrySample next_sample() const;
  /// Feeds the next odometry sample with the sensor data up to it; after the last one the robot ends its last submap.
  void feed_next(Timestamp now);
  /// The odometry samples that were fed, from the first.
  [[nodiscard]] std::size_t replayed() const { return next_; }
  /// The stamps of sensor data that feed_next() has fed last and that became keyframes.
  [[nodiscard]] const std::vector<Timestamp>& sensor_keyframes() const { return sensor_keyframes_; }

 private:
  void feed_sensors(Timestamp now);
  void feed_scan(Timestamp stamp, Timestamp now);
  void feed_images(Timestamp stamp, Timestamp now);
  void end_if_over(Timestamp now);

  const Recording& recording_;
  double start_s_;
  Driver& driver_;
  std::size_t next_ = 0;  // odometry sample
  std::size_t next_scan_ = 0, next_images_ = 0, next_measured_ = 0;
  std::vector<Timestamp> sensor_keyframes_;
};

}  // namespace tutti::drive
