// SPDX-License-Identifier: BSD-3-Clause
// Loop closures between the submaps of two simulated robots, judged against the truth: how many of the pairs that are
// near each other, how many wrong, how accurate, how honest their covariance, how fast, how much memory. Every pair
// goes through verification, as in a mission. Not a timing loop, so not Google Benchmark.
//
//   bench_lidar_world [--world tunnel|terrace] [--seed N] [--minutes M] [--block METRES] [--stride K]
//                     [--set key=value ...]
//
// --stride  Of the pairs more than 15 m apart only every K-th. A closure is wrong beyond 0.5 m or 2 degrees. Times are
//           CPU time of the one thread.
#include <fmt/format.h>

#include <Eigen/LU>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lidar_hku_samples.hpp"
#include "tutti/base/config_io.hpp"
#include "tutti/perception/lidar/verify.hpp"
#include "tutti/robot/submap_builder.hpp"
#include "tutti/simulation/bvh.hpp"
#include "tutti/simulation/lidar.hpp"
#include "tutti/simulation/odometry.hpp"
#include "tutti/simulation/surface.hpp"
#include "tutti/simulation/trajectory.hpp"
#include "tutti/simulation/world.hpp"

namespace {

using namespace tutti;
using bench::cpu_ms;
using bench::kDegPerRad;
using bench::percentile;
using bench::value_or_exit;

constexpr double kSpeed = 0.34;  // m/s, of a legged robot that looks around
constexpr Timestamp kStart{1'700'000'000'000'000'000LL};

struct WorldOptions {
  simulation::WorldConfig world;
  std::uint64_t seed = 1;
  double minutes = 15.0;
  int stride = 1;
  lidar::LidarClosureConfig config;
};

struct Seen {
  Submap submap;
  std::vector<Pose3> truth;  // of its keyframes
  lidar::SubmapFeatures features;
};

std::vector<Seen> walk_one(const simulation::CorridorWorld& world, std::shared_ptr<const simulation::Bvh> surface,
                           RobotId robot, std::size_t start, const WorldOptions& options, Rng rng) {
  simulation::WalkConfig walk;
  walk.duration_s = 60.0 * options.minutes;
  walk.length_m = kSpeed * walk.duration_s;
  const Trajectory truth = simulation::simulate_walk(world, walk, kStart, start, rng.fork("walk"));
  const auto run =
      simulation::simulate_odometry(truth, simulation::surroundings_along(world, truth), {}, rng.fork("odometry"));
  const simulation::SimulatedLidar sensor(std::move(surface), truth, {}, rng.fork("lidar"));
  robot::SubmapBuilder builder(robot, {});
  std::vector<Seen> out;
  const auto keep = [&](std::optional<Submap> submap) {
    if (!submap) return;
    Seen seen{.submap = std::move(*submap)};
    for (const Keyframe& keyframe : seen.submap.keyframes)
      seen.truth.push_back(truth[static_cast<std::size_t>(std::lround((keyframe.stamp - kStart) * walk.rate_hz))].pose);
    out.push_back(std::move(seen));
  };
  for (std::size_t k = 0; k < truth.size(); ++k) {
    const Matrix6d covariance = k > 0 ? run.increment_covariance[k - 1] : Matrix6d(Matrix6d::Zero());
    value_or_exit(builder.add_odometry(run.odometry[k].stamp, run.odometry[k].pose, covariance));
    keep(builder.take_submap());
    if (!builder.wants_scan()) continue;
    if (const auto scan = value_or_exit(sensor.scan(k))) {
      if (const auto ok = builder.add_scan(*scan); !ok) fmt::print(stderr, "{}\n", ok.error().message);
    }
  }
  builder.finish();
  keep(builder.take_submap());
  return out;
}

std::vector<Seen> walk_all(const WorldOptions& options) {
  const Rng rng(options.seed);
  const auto world = simulation::make_world(options.world, rng.fork("world"));
  const auto surface =
      std::make_shared<const simulation::Bvh>(simulation::world_surface(world, {}, rng.fork("surface")));
  const auto starts = simulation::spread_starts(world, 2, rng.fork("starts"));
  std::vector<Seen> all;
  for (std::uint32_t robot = 0; robot < 2; ++robot)
    for (Seen& seen :
         walk_one(world, surface, RobotId{robot}, starts[robot], options, rng.fork(fmt::format("robot {}", robot))))
      all.push_back(std::move(seen));
  return all;
}

double resident_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::atof(line.c_str() + 6) / 1024.0;
  return 0.0;
}

struct Tally {
  int pairs = 0, near = 0, near_accepted = 0, accepted = 0, wrong = 0;
  std::vector<double> m, deg, nees, near_ms, far_ms;
};

void judge(const Seen& a, const Seen& b, const WorldOptions& options, int& far, Tally& tally) {
  const Pose3 truth = a.truth[(a.truth.size() - 1) / 2].inverse() * b.truth[(b.truth.size() - 1) / 2];
  const double apart = truth.translation.norm();
  if (apart > 15.0 && ++far % options.stride != 0) return;
  const double start = cpu_ms();
  const auto verification = lidar::verify_pair(a.features, b.features, options.config);
  (apart < 3.0 ? tally.near_ms : tally.far_ms).push_back(cpu_ms() - start);
  ++tally.pairs;
  tally.near += apart < 3.0;
  if (!verification.accepted) return;
  ++tally.accepted;
  tally.near_accepted += apart < 3.0;
  const auto& measured = lidar::to_verdict(a.submap, b.submap, verification).closures.front().measurement;
  const Vector6d error = local(truth, measured.T_a_b);
  const double m = error.head<3>().norm(), deg = error.tail<3>().norm() * kDegPerRad;
  if (m > 0.5 || deg > 2.0) {
    ++tally.wrong;
    return;
  }
  tally.m.push_back(m);
  tally.deg.push_back(deg);
  tally.nees.push_back(error.dot(measured.covariance.inverse() * error));
}

double sum(const std::vector<double>& values) {
  double total = 0.0;
  for (const double value : values) total += value;
  return total;
}

void run(const WorldOptions& options) {
  auto all = walk_all(options);
  const double before_mb = resident_mb(), start = cpu_ms();
  for (Seen& seen : all) seen.features = lidar::extract_features(seen.submap, options.config);
  const auto count = static_cast<double>(all.size());
  fmt::print("{} submaps, features {:.1f} ms and {:.2f} MB each\n", all.size(), (cpu_ms() - start) / count,
             (resident_mb() - before_mb) / count);
  Tally tally;
  int far = 0;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = i + 1; j < all.size(); ++j)
      if (all[i].submap.id.chain != all[j].submap.id.chain || j - i >= 2) judge(all[i], all[j], options, far, tally);
  fmt::print("pairs {}: accepted {}, wrong {}; of those within 3 m {} of {}\n", tally.pairs, tally.accepted,
             tally.wrong, tally.near_accepted, tally.near);
  fmt::print("error median {:.3f} m {:.3f} deg, 95 % {:.3f} m {:.3f} deg; NEES median {:.1f} (5.3 when exact)\n",
             percentile(tally.m, 0.5), percentile(tally.deg, 0.5), percentile(tally.m, 0.95),
             percentile(tally.deg, 0.95), percentile(tally.nees, 0.5));
  fmt::print("ms a pair: within 3 m {:.1f}, others {:.2f}; {:.1f} s in all\n",
             sum(tally.near_ms) / static_cast<double>(tally.near_ms.size()),
             sum(tally.far_ms) / static_cast<double>(tally.far_ms.size()),
             1e-3 * (sum(tally.near_ms) + sum(tally.far_ms)));
}

std::optional<WorldOptions> parse(int argc, char** argv) {
  WorldOptions options;
  options.world.network.block_m = 30.0;
  ConfigNode settings{.kind = ConfigNode::Kind::map};
  for (int i = 1; i + 1 < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--world" && (value == "tunnel" || value == "terrace"))
      options.world.kind = value;
    else if (name == "--seed")
      options.seed = std::strtoull(value.c_str(), nullptr, 10);
    else if (name == "--minutes")
      options.minutes = std::atof(value.c_str());
    else if (name == "--block")
      options.world.network.block_m = std::atof(value.c_str());
    else if (name == "--stride")
      options.stride = std::max(1, std::atoi(value.c_str()));
    else if (name != "--set" || !apply_override(settings, value))
      return std::nullopt;
  }
  const auto loaded = load_config(settings, options.config, "--set");
  if (!loaded) fmt::print(stderr, "{}\n", loaded.error().message);
  return loaded && argc % 2 == 1 ? std::optional(options) : std::nullopt;
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = parse(argc, argv);
  if (!options) return 2;
  run(*options);
}
