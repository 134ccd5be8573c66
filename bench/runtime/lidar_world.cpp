// SPDX-License-Identifier: BSD-3-Clause
// Loop closures between the submaps of a mission's robots, judged against the truth: how many of the pairs that are
// near each other, how many wrong, how accurate, how honest their covariance, how fast, how much memory. Every pair
// goes through verification, as in a mission. Not a timing loop, so not Google Benchmark.
//
//   bench_lidar_world MISSION.yaml [--seed N] [--stride K] [--set key=value ...]
//
// --stride  Of the pairs more than 15 m apart only every K-th. A closure is wrong beyond 0.5 m or 2 degrees. Times are
//           CPU time of the one thread. bench/runtime/lidar_car.yaml is two cars with 64 beams.
#include <fmt/format.h>

#include <Eigen/LU>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "lidar_hku_samples.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/verify.hpp"
#include "tutti/robot/submap_builder.hpp"

namespace {

using namespace tutti;
using bench::cpu_ms;
using bench::kDegPerRad;
using bench::percentile;
using bench::value_or_exit;

struct WorldOptions {
  std::string mission;
  std::vector<std::string> assignments;
  std::uint64_t seed = 1;
  int stride = 1;
};

struct Seen {
  Submap submap;
  std::vector<Pose3> truth;  // of its keyframes
  lidar::SubmapFeatures features;
};

std::vector<Seen> walk_one(const Recording& recording, const robot::SubmapConfig& config, double until_s) {
  const auto& odometry = recording.odometry;
  robot::SubmapBuilder builder(recording.robot, config);
  std::vector<Seen> out;
  const auto keep = [&](std::optional<Submap> submap) {
    if (!submap) return;
    Seen seen{.submap = std::move(*submap)};
    for (const Keyframe& keyframe : seen.submap.keyframes)
      seen.truth.push_back(pose_at(recording.reference, keyframe.stamp).value());
    out.push_back(std::move(seen));
  };
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    if (until_s > 0.0 && odometry[k].stamp - odometry.front().stamp > until_s) break;
    const Matrix6d covariance = k > 0 ? recording.increment_covariance[k - 1] : Matrix6d(Matrix6d::Zero());
    value_or_exit(builder.add(OdometrySample{odometry[k].stamp, odometry[k].pose, covariance}));
    keep(builder.take_submap());
    if (!builder.wants_scan()) continue;
    if (const auto scan = value_or_exit(recording.scans->scan(k)))
      if (const auto ok = builder.add(*scan); !ok) fmt::print(stderr, "{}\n", ok.error().message);
  }
  builder.finish();
  keep(builder.take_submap());
  return out;
}

double resident_mb() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmRSS:")) return std::atof(line.c_str() + 6) / 1024.0;
  return 0.0;
}

struct Tally {
  int pairs = 0, near = 0, near_accepted = 0, accepted = 0, wrong = 0;
  std::vector<double> m, deg, nees, nees_m, nees_rad, accepted_ms, refused_ms;
};

void judge(const Seen& a, const Seen& b, const lidar::LidarClosureConfig& config, int stride, int& far, Tally& tally) {
  const Pose3 truth = a.truth[(a.truth.size() - 1) / 2].inverse() * b.truth[(b.truth.size() - 1) / 2];
  const double apart = truth.translation.norm();
  if (apart > 15.0 && ++far % stride != 0) return;
  const double start = cpu_ms();
  const auto verification = lidar::verify_pair(a.features, b.features, config);
  const auto verdict = lidar::to_verdict(a.submap, b.submap, verification);
  (verification.accepted ? tally.accepted_ms : tally.refused_ms).push_back(cpu_ms() - start);
  const bool is_near = apart < std::min(3.0, config.max_viewpoint_distance_m);
  ++tally.pairs;
  tally.near += is_near;
  if (!verification.accepted) return;
  ++tally.accepted;
  tally.near_accepted += is_near;
  const auto& measured = verdict.closures.front().measurement;
  const Vector6d error = local(truth, measured.T_a_b);
  const double m = error.head<3>().norm(), deg = error.tail<3>().norm() * kDegPerRad;
  if (m > 0.5 || deg > 2.0) {
    ++tally.wrong;
    return;
  }
  tally.m.push_back(m);
  tally.deg.push_back(deg);
  tally.nees.push_back(squared_distance(error, measured.covariance));
  tally.nees_m.push_back(
      squared_distance(Eigen::Vector3d(error.head<3>()), Eigen::Matrix3d(measured.covariance.topLeftCorner<3, 3>())));
  tally.nees_rad.push_back(squared_distance(Eigen::Vector3d(error.tail<3>()),
                                            Eigen::Matrix3d(measured.covariance.bottomRightCorner<3, 3>())));
}

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }
double mean(const std::vector<double>& values) { return sum(values) / static_cast<double>(values.size()); }

std::vector<Seen> walk_all(const lab::MissionConfig& config, std::uint64_t seed) {
  std::vector<Seen> all;
  double points = 0.0;
  for (const auto& robot : value_or_exit(lab::load_input(config, "", seed)).robots)
    for (Seen& seen : walk_one(robot.recording, config.agent.submap, config.duration_s)) {
      points += static_cast<double>(seen.submap.cloud->points.size());
      all.push_back(std::move(seen));
    }
  const double before_mb = resident_mb(), start = cpu_ms();
  for (Seen& seen : all) seen.features = lidar::extract_features(seen.submap, config.closures.lidar);
  const auto count = static_cast<double>(all.size());
  fmt::print("{} submaps of {:.0f} points, features {:.1f} ms and {:.2f} MB each\n", all.size(), points / count,
             (cpu_ms() - start) / count, (resident_mb() - before_mb) / count);
  return all;
}

void run(const lab::MissionConfig& config, const WorldOptions& options) {
  const auto all = walk_all(config, options.seed);
  const auto gap = static_cast<std::size_t>(config.closures.min_submap_gap);
  Tally tally;
  int far = 0;
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = i + 1; j < all.size(); ++j)
      if ((all[i].submap.id.chain != all[j].submap.id.chain || j - i >= gap) &&
          lidar::plausible_pair(all[i].features, all[j].features))
        judge(all[i], all[j], config.closures.lidar, options.stride, far, tally);
  fmt::print("pairs {}: accepted {}, wrong {}; of those within 3 m {} of {}\n", tally.pairs, tally.accepted,
             tally.wrong, tally.near_accepted, tally.near);
  fmt::print("error median {:.3f} m {:.3f} deg, 95 % {:.3f} m {:.3f} deg\n", percentile(tally.m, 0.5),
             percentile(tally.deg, 0.5), percentile(tally.m, 0.95), percentile(tally.deg, 0.95));
  fmt::print(
      "NEES mean {:.2f}, median {:.2f}, 95 % {:.1f}, worst {:.1f} (exact: 6, 5.35, 12.6); translation {:.2f}, rotation "
      "{:.2f} (3)\n",
      mean(tally.nees), percentile(tally.nees, 0.5), percentile(tally.nees, 0.95), percentile(tally.nees, 1.0),
      mean(tally.nees_m), mean(tally.nees_rad));
  fmt::print("ms a pair: accepted {:.1f}, refused {:.2f}; {:.1f} s in all\n", mean(tally.accepted_ms),
             mean(tally.refused_ms), 1e-3 * (sum(tally.accepted_ms) + sum(tally.refused_ms)));
}

std::optional<WorldOptions> parse(int argc, char** argv) {
  if (argc % 2 != 0) return std::nullopt;
  WorldOptions options{.mission = argv[1]};
  for (int i = 2; i < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--seed")
      options.seed = std::strtoull(value.c_str(), nullptr, 10);
    else if (name == "--stride")
      options.stride = std::max(1, std::atoi(value.c_str()));
    else if (name == "--set")
      options.assignments.push_back(value);
    else
      return std::nullopt;
  }
  return options;
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = parse(argc, argv);
  if (!options) {
    fmt::print(stderr, "usage: bench_lidar_world MISSION.yaml [--seed N] [--stride K] [--set key=value ...]\n");
    return 2;
  }
  run(value_or_exit(lab::load_mission(options->mission, options->assignments)), *options);
}
