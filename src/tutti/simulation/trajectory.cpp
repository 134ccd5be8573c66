// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/simulation/trajectory.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::simulation {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kIntegrationStep_s = 0.025;
constexpr double kSpeedTime_s = 10.0;    // how fast the speed wanders
constexpr double kSettleTime_s = 1.0;    // from full speed to standing
constexpr double kHeightLength_m = 1.0;  // slopes are smoothed over this

bool are_joined(const CorridorWorld& world, std::size_t a, std::size_t b) {
  return std::ranges::any_of(world.corridors_at[a],
                             [&](std::size_t corridor) { return world.other_end(corridor, a) == b; });
}

/// Endless walk from junction to junction; hands out the corners of its path.
class Route {
 public:
  /// `junctions`: to go round in order, the first being `start`; empty = wherever was seen least.
  Route(const CorridorWorld& world, std::size_t start, std::vector<int> junctions, Rng rng)
      : world_(world),
        given_(std::move(junctions)),
        rng_(std::move(rng)),
        junction_(start),
        visits_(world.corridors.size(), 0) {}

  [[nodiscard]] Eigen::Vector3d position() const { return world_.junctions[junction_]; }

  Eigen::Vector3d advance() {
    if (given_.empty()) {
      explore();
    } else {
      next_given_ = (next_given_ + 1) % given_.size();
      junction_ = static_cast<std::size_t>(given_[next_given_]);
    }
    return position();
  }

 private:
  /// A corridor seen least, not back unless there is no other.
  void explore() {
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
  }

  const CorridorWorld& world_;
  std::vector<int> given_;
  std::size_t next_given_ = 0;
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

  void step(const Carrot& carrot, double speed, double dt) {
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

/// `share` of the gait: 1 = walking, 0 = standing.
Pose3 body_pose(const Walker& walker, const Gait& gait, double time_s, double phase, double share) {
  const double step = 2.0 * kPi * gait.step_hz * time_s + phase;
  const double sway = share * gait.sway_deg * kRadPerDeg;
  const double bob = share * gait.bob_m;
  const Eigen::Quaterniond rotation =
      Eigen::AngleAxisd(walker.yaw, Eigen::Vector3d::UnitZ()) *
      Eigen::AngleAxisd(walker.pitch + sway * std::sin(2.0 * step), Eigen::Vector3d::UnitY()) *
      Eigen::AngleAxisd(sway * std::sin(step), Eigen::Vector3d::UnitX());
  return {rotation.normalized(), walker.position + Eigen::Vector3d(0.0, 0.0, bob * std::sin(2.0 * step))};
}

/// Speed at every step of a walk: wanders between the two limits, falls to 0 at a stop.
std::vector<double> draw_speeds(const WalkConfig& config, std::size_t samples, int substeps, Rng& rng) {
  const double dt = 1.0 / (config.rate_hz * substeps);
  const double most_change = dt * config.max_speed_mps / kSettleTime_s;
  double wish = rng.uniform(config.min_speed_mps, config.max_speed_mps);
  double speed = wish;
  double stop_s = 0.0;  // still to stand
  std::vector<double> speeds;
  speeds.reserve(samples * static_cast<std::size_t>(substeps));
  for (std::size_t i = 0; i < samples; ++i) {
    stop_s -= 1.0 / config.rate_hz;
    if (rng.bernoulli(std::min(1.0, 1.0 / (config.rate_hz * kSpeedTime_s))))
      wish = rng.uniform(config.min_speed_mps, config.max_speed_mps);
    if (stop_s <= 0.0 && rng.bernoulli(std::min(1.0, config.pauses_per_min / (60.0 * config.rate_hz))))
      stop_s = rng.uniform(0.5, 1.5) * config.pause_s;
    for (int k = 0; k < substeps; ++k) {
      speed += std::clamp((stop_s > 0.0 ? 0.0 : wish) - speed, -most_change, most_change);
      speeds.push_back(speed);
    }
  }
  return speeds;
}

/// Can be computed: in memory, and step by step along the trajectory.
Status check_size(const WalkConfig& config) {
  constexpr double kMostPoses = 5e6;
  const double poses = config.duration_s * config.rate_hz;
  if (poses > kMostPoses)
    return fail(ErrorCode::configuration, "walk: duration_s {} at rate_hz {} makes {:.3g} poses, expected at most {:g}",
                config.duration_s, config.rate_hz, poses, kMostPoses);
  const double distance_m = config.length_m > 0.0 ? config.length_m : config.duration_s * config.max_speed_mps;
  if (distance_m > kFarthest_m)
    return fail(ErrorCode::configuration,
                "walk: duration_s {} at max_speed_mps {} makes {:.3g} m, expected at most {:g}", config.duration_s,
                config.max_speed_mps, distance_m, kFarthest_m);
  return {};
}

/// How far apart the places are that the walk leads to, along x or y: wherever the robot is, one of them is at least
/// half of this away.
double width_of(const CorridorWorld& world, const std::vector<int>& route) {
  Eigen::AlignedBox2d box;
  if (route.empty())
    for (const Eigen::Vector3d& junction : world.junctions) box.extend(junction.head<2>());
  for (const int junction : route) box.extend(world.junctions[static_cast<std::size_t>(junction)].head<2>());
  return box.sizes().maxCoeff();
}

/// The point that the robot steers to must be somewhere on its trajectory.
Status check_lookahead(const CorridorWorld& world, const WalkConfig& config) {
  const double most_m = 0.5 * width_of(world, config.route);
  if (config.lookahead_m < most_m) return {};
  return fail(ErrorCode::configuration,
              "walk.lookahead_m is {}, expected less than {:.3g}, half the width of the network or route",
              config.lookahead_m, most_m);
}

Status check_route(const CorridorWorld& world, const std::vector<int>& junctions) {
  const std::vector<std::size_t> route(junctions.begin(), junctions.end());
  for (std::size_t i = 0; i < route.size(); ++i) {
    if (route[i] >= world.junctions.size())
      return fail(ErrorCode::configuration, "walk.route.{} is {}, the world has 0 .. {}", i, junctions[i],
                  world.junctions.size() - 1);
    const std::size_t next = route[(i + 1) % route.size()];
    if (next < world.junctions.size() && !are_joined(world, route[i], next))
      return fail(ErrorCode::configuration, "walk.route: no corridor joins junctions {} and {}", route[i], next);
    if (route[(i + 2) % route.size()] == route[i])
      return fail(ErrorCode::configuration, "walk.route: turns back at junction {}, where there is no room", next);
  }
  return {};
}

}  // namespace

const std::vector<Gait>& gaits() {
  static const std::vector<Gait> rows{
      {"walking", "sways by 0.8 degrees, bobs by 1 cm, 1.3 steps a second", 0.8, 0.01, 1.3},
      {"trotting", "bobs by 5 mm, 1 step a second", 0.8, 0.005, 1.0},
      {"stepping", "bobs by 5 mm, 1.5 steps a second", 0.8, 0.005, 1.5},
      {"driving", "a car: sways by 0.2 degrees", 0.2, 0.01, 1.3},
      {"rolling", "wheels on a floor: neither", 0.0, 0.0, 1.0},
  };
  return rows;
}

Status check_walk(const CorridorWorld& world, const WalkConfig& config, std::optional<std::size_t> start_junction) {
  if (config.max_speed_mps < config.min_speed_mps)
    return fail(ErrorCode::configuration, "walk: max_speed_mps is {}, expected at least min_speed_mps = {}",
                config.max_speed_mps, config.min_speed_mps);
  const std::size_t junctions = world.junctions.size();
  if (start_junction && *start_junction >= junctions)
    return fail(ErrorCode::configuration, "start_junction is {}, the world has 0 .. {}", *start_junction,
                junctions - 1);
  if (!config.route.empty() && start_junction)
    return fail(ErrorCode::configuration,
                "start_junction and walk.route are both given, expected one: a route starts "
                "at its first junction");
  if (auto ok = check_route(world, config.route); !ok) return ok;
  if (auto ok = check_size(config); !ok) return ok;
  return check_lookahead(world, config);
}

Trajectory simulate_walk(const CorridorWorld& world, const WalkConfig& config, Timestamp start,
                         std::optional<std::size_t> start_junction, Rng rng) {
  const Status ok = check_walk(world, config, start_junction);
  TUTTI_CHECK(ok.has_value(), "{}", ok.error().message);
  const Gait* gait = row_of(gaits(), config.gait);
  TUTTI_CHECK(gait != nullptr, "gait '{}'", config.gait);
  std::size_t first = start_junction.value_or(rng.index(world.junctions.size()));
  if (!config.route.empty()) first = static_cast<std::size_t>(config.route.front());

  const double phase = rng.uniform(0.0, 2.0 * kPi);
  Carrot carrot(Route(world, first, config.route, rng.fork("route")), config.lookahead_m);
  Walker walker{.position = world.junctions[first]};
  const Eigen::Vector3d ahead = carrot.direction();
  walker.yaw = std::atan2(ahead.y(), ahead.x());
  walker.pitch = -std::asin(ahead.z());

  const auto samples = static_cast<std::size_t>(std::floor(config.duration_s * config.rate_hz)) + 1;
  const int substeps = std::max(1, static_cast<int>(std::ceil(1.0 / (config.rate_hz * kIntegrationStep_s))));
  const double dt = 1.0 / (config.rate_hz * substeps);
  const std::vector<double> speeds = draw_speeds(config, samples, substeps, rng);
  // The steps of the last sample are never taken.
  const double natural_m = dt * std::accumulate(speeds.begin(), speeds.end() - substeps, 0.0);
  const double pace = config.length_m > 0.0 && natural_m > 0.0 ? config.length_m / natural_m : 1.0;
  Trajectory truth;
  truth.reserve(samples);
  std::size_t step = 0;
  for (std::size_t i = 0; i < samples; ++i) {
    const double time_s = static_cast<double>(i) / config.rate_hz;
    const double share = std::min(1.0, speeds[step] / config.min_speed_mps);
    truth.push_back({start + time_s, body_pose(walker, *gait, time_s, phase, share)});
    for (int k = 0; k < substeps; ++k, ++step) {
      carrot.keep_ahead_of(walker.position);
      walker.step(carrot, pace * speeds[step], dt);
    }
  }
  return truth;
}

}  // namespace tutti::simulation
