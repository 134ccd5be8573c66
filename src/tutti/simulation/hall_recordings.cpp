// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/hall_recordings.hpp"

#include <optional>
#include <set>
#include <utility>

#include "tutti/simulation/imu.hpp"

namespace tutti::simulation {
namespace {

/// As EuRoC's, looking ahead.
std::vector<Camera> make_cameras(int count, bool half_resolution) {
  constexpr double kBaseline_m = 0.11;
  const CameraModel model{.kind = CameraKind::pinhole,
                          .width_px = 752,
                          .height_px = 480,
                          .fx = 458.654,
                          .fy = 457.296,
                          .cx = 367.215,
                          .cy = 248.375,
                          .distortion = {-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05}};
  Eigen::Matrix3d R_body_camera;  // z ahead, x to the right, y down
  R_body_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  std::vector<Camera> out;
  for (int i = 0; i < count; ++i)
    out.push_back(
        {half_resolution ? halved(model) : model, {Eigen::Quaterniond(R_body_camera), {0.1, -kBaseline_m * i, 0.0}}});
  return out;
}

Status check_names(const std::vector<FlyingRobotConfig>& robots) {
  if (robots.empty()) return fail(ErrorCode::configuration, "hall.robots is empty, expected a robot");
  std::set<std::string> names;
  for (std::size_t i = 0; i < robots.size(); ++i)
    if (robots[i].name.empty() || !names.insert(robots[i].name).second)
      return fail(ErrorCode::configuration, "hall.robots.{}: name '{}' is empty or taken", i, robots[i].name);
  return {};
}

}  // namespace

Result<SimulatedHall> simulate_hall(const HallMissionConfig& config, Timestamp start, std::uint64_t seed) {
  if (auto ok = check_names(config.robots); !ok) return tl::unexpected(ok.error());
  const Rng rng(seed);
  const auto scene = std::make_shared<const HallScene>(make_hall(config.world, rng.fork("hall")));
  const std::shared_ptr<const Bvh> walls(scene, &scene->surface);
  SimulatedHall out{.robots = {}, .surface = std::shared_ptr<const TriangleMesh>(scene, &scene->hall.mesh)};
  for (const FlyingRobotConfig& robot : config.robots) {
    const Rng own = rng.fork(robot.name);
    FlownRecording flown;
    Recording& recording = flown.recording;
    recording.robot = RobotId{static_cast<std::uint32_t>(out.robots.size())};
    recording.name = robot.name;
    recording.reference = simulate_flight(robot.flight, start + robot.start_s);
    OdometrySimulation simulated =
        simulate_odometry(recording.reference, {}, robot.odometry.config(), own.fork("odometry"));
    recording.odometry = std::move(simulated.odometry);
    recording.increment_covariance = std::move(simulated.increment_covariance);
    recording.drift_origins = std::move(simulated.drift_origins);
    if (robot.sensors != "visual")
      recording.scans =
          std::make_shared<SimulatedLidar>(walls, recording.reference, config.lidar.config(), own.fork("lidar"));
    if (robot.sensors != "lidar") {
      flown.images = simulate_images(scene, make_cameras(config.cameras, config.half_resolution), recording.reference,
                                     config.images, own.fork("images"),
                                     config.depth ? std::optional(DepthSensor{}) : std::nullopt);
      if (config.imu) {
        const ImuConfig imu;
        recording.imu = simulate_imu([&](double time_s) { return flight_motion(robot.flight, time_s); },
                                     start + robot.start_s, robot.flight.duration_s, imu, own.fork("imu"));
        recording.imu_noise = imu.noise();
      }
    }
    out.robots.push_back(std::move(flown));
  }
  return out;
}

}  // namespace tutti::simulation
