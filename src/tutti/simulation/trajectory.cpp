// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/trajectory.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "tutti/base/check.hpp"

namespace tutti::simulation {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kIntegrationStep_s = 0.025;
constexpr double kSpeedTime_s = 10.0;    // how fast the speed wanders
constexpr double kHeightLength_m = 1.0;  // slopes are smoothed over this

/// Endless walk from junction to junction; hands out the corners of its path.
class Route {
 public:
  Route(const CorridorWorld& world, std::size_t start, Rng rng)
      : world_(world), rng_(std::move(rng)), junction_(start), visits_(world.corridors.size(), 0) {}

  [[nodiscard]] Eigen::Vector3d position() const { return world_.junctions[junction_]; }

  /// Goes to the next junction: a corridor seen least, not back unless there is no other.
  Eigen::Vector3d advance() {
    std::vector<std::size_t> choices;
    for (const std::size_t corridor : world_.corridors_at[junction_]) {
      if (corridor == last_ && world_.corridors_at[junction_].size() > 1) continue;
      if (!choices.empty() && visits_[corridor] > visits_[choices.front()]) continue;
      if (!choices.empty() && visits_[corridor] < visits_[choices.front()]) choices.clear();
      choices.push_back(corridor);
    }
    last_ = choices[rng_.index(choices.size())];
    ++visits_[last_];
    junction_ = world_.other_end(last_, junction_);
    return position();
  }

 private:
  const CorridorWorld& world_;
  Rng rng_;
  std::size_t junction_;
  std::size_t last_ = static_cast<std::size_t>(-1);
  std::vector<int> visits_;
};

/// The point the robot steers to: moves along the route and stays `lookahead` ahead of the robot, in the plane.
class Carrot {
 public:
  Carrot(Route route, double lookahead_m) : route_(std::move(route)), lookahead_m_(lookahead_m) {
    from_ = route_.position();
    to_ = route_.advance();
  }
  [[nodiscard]] Eigen::Vector3d position() const {
    const double length = (to_ - from_).head<2>().norm();
    return from_ + (to_ - from_) * (travelled_m_ / length);
  }
  [[nodiscard]] Eigen::Vector3d direction() const { return (to_ - from_).normalized(); }
  void keep_ahead_of(const Eigen::Vector3d& robot) {
    constexpr double kStep_m = 0.01;
    while ((position() - robot).head<2>().norm() < lookahead_m_) {
      travelled_m_ += kStep_m;
      if (travelled_m_ < (to_ - from_).head<2>().norm()) continue;
      travelled_m_ = 0.0;
      from_ = to_;
      to_ = route_.advance();
    }
  }

 private:
  Route route_;
  double lookahead_m_;
  Eigen::Vector3d from_, to_;
  double travelled_m_ = 0.0;
};

struct Walker {
  Eigen::Vector3d position;
  double yaw = 0.0;
  double pitch = 0.0;  // nose down positive, as a rotation about body y
  double speed = 0.0;

  void step(const Carrot& carrot, double dt) {
    const Eigen::Vector3d to_carrot = carrot.position() - position;
    const double distance = to_carrot.head<2>().norm();
    const double alpha = std::remainder(std::atan2(to_carrot.y(), to_carrot.x()) - yaw, 2.0 * kPi);
    // Pure pursuit; behind us the arc would be wide again, so turn as sharply as for a point abeam.
    const double sine = std::abs(alpha) > 0.5 * kPi ? std::copysign(1.0, alpha) : std::sin(alpha);
    const double yaw_rate = speed * 2.0 * sine / distance;
    const double middle = yaw + 0.5 * yaw_rate * dt;
    const double slope = to_carrot.z() / distance;
    pitch += (-std::atan(slope) - pitch) * std::min(1.0, speed * dt / kHeightLength_m);
    const double forward = speed * std::cos(pitch);
    position += dt * Eigen::Vector3d(forward * std::cos(middle), forward * std::sin(middle), -speed * std::sin(pitch));
    yaw += yaw_rate * dt;
  }
};

Pose3 body_pose(const Walker& walker, const WalkConfig& config, double time_s, double phase) {
  const double step = 2.0 * kPi * config.step_hz * time_s + phase;
  const double sway = config.sway_deg * kPi / 180.0;
  const Eigen::Quaterniond rotation =
      Eigen::AngleAxisd(walker.yaw, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(walker.pitch + sway * std::sin(2.0 * step), Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(sway * std::sin(step), Eigen::Vector3d::UnitX());
  return {rotation.normalized(), walker.position + Eigen::Vector3d(0.0, 0.0, config.bob_m * std::sin(2.0 * step))};
}

}  // namespace

Trajectory simulate_walk(const CorridorWorld& world, const WalkConfig& config, Timestamp start,
                         std::optional<std::size_t> start_junction, Rng rng) {
  TUTTI_CHECK(config.max_speed_mps >= config.min_speed_mps, "speeds {} .. {} m/s", config.min_speed_mps,
              config.max_speed_mps);
  const std::size_t first = start_junction.value_or(rng.index(world.junctions.size()));
  TUTTI_CHECK(first < world.junctions.size(), "junction {}", first);

  const double phase = rng.uniform(0.0, 2.0 * kPi);
  Carrot carrot(Route(world, first, rng.fork("route")), config.lookahead_m);
  Walker walker{.position = world.junctions[first]};
  const Eigen::Vector3d ahead = carrot.direction();
  walker.yaw = std::atan2(ahead.y(), ahead.x());
  walker.pitch = -std::asin(ahead.z());
  double wish = rng.uniform(config.min_speed_mps, config.max_speed_mps);
  walker.speed = wish;

  const auto samples = static_cast<std::size_t>(std::floor(config.duration_s * config.rate_hz)) + 1;
  const int substeps = std::max(1, static_cast<int>(std::ceil(1.0 / (config.rate_hz * kIntegrationStep_s))));
  const double dt = 1.0 / (config.rate_hz * substeps);
  Trajectory truth;
  truth.reserve(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const double time_s = static_cast<double>(i) / config.rate_hz;
    truth.push_back({start + time_s, body_pose(walker, config, time_s, phase)});
    if (rng.bernoulli(std::min(1.0, 1.0 / (config.rate_hz * kSpeedTime_s))))
      wish = rng.uniform(config.min_speed_mps, config.max_speed_mps);
    for (int k = 0; k < substeps; ++k) {
      walker.speed += (wish - walker.speed) * std::min(1.0, dt);  // settles in about 1 s
      carrot.keep_ahead_of(walker.position);
      walker.step(carrot, dt);
    }
  }
  return truth;
}

}  // namespace tutti::simulation
