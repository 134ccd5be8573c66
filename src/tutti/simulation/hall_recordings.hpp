// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/model/image_stream.hpp"
#include "tutti/model/recording.hpp"
#include "tutti/simulation/camera.hpp"
#include "tutti/simulation/flight.hpp"
#include "tutti/simulation/hall.hpp"
#include "tutti/simulation/lidar.hpp"
#include "tutti/simulation/odometry.hpp"

namespace tutti::simulation {

/// One robot in a hall: its sensors, flight and errors.
struct FlyingRobotConfig {
  std::string name;
  std::string sensors = "visual";
  double start_s = 0.0;
  FlightConfig flight;
  OdometryChoice odometry;
  template <class V>
  void describe(V& v) {
    v.field("name", name, any(), "Unique name.");
    v.field("sensors", sensors, one_of({"visual", "lidar", "both"}), "What it carries.");
    v.field("start_s", start_s, between(0.0, kLongest_s), "Mission time at which it starts to fly.");
    v.field("flight", flight, any(), "Where it flies.");
    v.field("odometry", odometry, any(), "Errors of its odometry.");
  }
};

/// Robots with cameras, LiDARs or both in one hall.
struct HallMissionConfig {
  HallConfig world;
  ImageConfig images;
  int cameras = 1;
  bool depth = false;
  bool half_resolution = true;  ///< Images of 376 x 240 pixels instead of 752 x 480, in a quarter of the time.
  bool imu = true;              ///< Robots with a camera have an IMU, too.
  LidarChoice lidar;
  std::vector<FlyingRobotConfig> robots;
  template <class V>
  void describe(V& v) {
    v.field("boxes", world.boxes, between(0, 10000), "How many stand there, a quarter of them in the middle.");
    v.field("cameras", cameras, between(1, 2),
            "How many a robot with cameras has; the second is 11 cm to the right of the first.");
    v.field("depth", depth, any(),
            "The camera, of one, is an RGB-D camera: depth within 8 m, 1.4 mm off at 1 m, growing with its square.");
    v.field("robots", robots, any(), "The robots, each with its own start and odom frame.");
  }
};

/// One robot's simulated run, with its images still untracked.
struct FlownRecording {
  Recording recording;  ///< Without `visual`: the caller tracks points through `images`.
  ImageStream images;   ///< Without stamps when there is no camera.
};

/// The recordings of a simulated hall, and the hall's surface.
struct SimulatedHall {
  std::vector<FlownRecording> robots;           ///< Robots 0, 1, ...
  std::shared_ptr<const TriangleMesh> surface;  ///< As a survey would measure it.
};

/// Simulates all robots of a hall; the first sample of each is at `start` + start_s. Fails when a robot has no name, or
/// two have the same.
Result<SimulatedHall> simulate_hall(const HallMissionConfig& config, Timestamp start, std::uint64_t seed);

}  // namespace tutti::simulation
