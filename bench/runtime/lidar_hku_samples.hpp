// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <iterator>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/formats/kitti.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/perception/lidar/submap_features.hpp"
#include "tutti/perception/lidar/voxel_filter.hpp"

/// The submaps of the two HKU recordings with their reference, for lidar_hku.cpp.
namespace tutti::bench {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kSubmapSeconds = 10.0;

struct Options {
  double drift_deg_per_m = 0.0;
  double scale = 0.0;
  std::uint64_t seed = 0;
  bool list = false;
  bool negative = false;
  std::string folder = TUTTI_SHARED_DIR "/data/lidar/hku_two_sessions";
  lidar::LidarClosureConfig config;
};

inline double cpu_ms() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) * 1e3 + static_cast<double>(t.tv_nsec) * 1e-6;
}

inline double percentile(std::vector<double> values, double share) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<std::size_t>(share * static_cast<double>(values.size())))];
}

template <class T>
T value_or_exit(Result<T> result) {
  if (result) {
    if constexpr (std::is_void_v<T>)
      return;
    else
      return *std::move(result);
  }
  fmt::print(stderr, "{}\n", result.error().message);
  std::exit(1);
}

struct Session {
  Trajectory reference;  // T_odom1_body
  std::vector<std::shared_ptr<const PointCloud>> clouds;
};

inline Session load(const std::string& folder, const Pose3& T_odom1_odom) {
  Session session;
  session.reference =
      value_or_exit(formats::with_times(value_or_exit(formats::read_trajectory(folder + "/odom_poses.txt")),
                                        value_or_exit(formats::read_times(folder + "/times.txt"))));
  for (auto& pose : session.reference) {
    pose.pose = T_odom1_odom * pose.pose;
    const auto file = fmt::format("{}/Scans/{:06d}.pcd", folder, session.clouds.size());
    session.clouds.push_back(std::make_shared<PointCloud>(value_or_exit(formats::read_timed_pcd(file)).cloud));
  }
  return session;
}

/// The derived transform as a file of one 4x4 matrix.
inline Pose3 load_transform(const std::string& path) {
  FILE* file = std::fopen(path.c_str(), "r");
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  char line[1024];
  int row = 0;
  while (file != nullptr && row < 4 && std::fgets(line, sizeof line, file) != nullptr)
    if (std::sscanf(line, "%lf %lf %lf %lf", &m(row, 0), &m(row, 1), &m(row, 2), &m(row, 3)) == 4) ++row;
  if (file != nullptr) std::fclose(file);
  if (row == 4) return Pose3::from_matrix(m);
  fmt::print(stderr, "{}: expected a 4x4 matrix\n", path);
  std::exit(1);
}

/// Odometry with a yaw drift about the reference's vertical and a scale error, starting at T_odom_start.
inline std::vector<Pose3> degrade(const Trajectory& reference, double drift_deg_per_m, double scale,
                                  const Pose3& T_odom_start) {
  std::vector<Pose3> out{T_odom_start};
  for (std::size_t k = 1; k < reference.size(); ++k) {
    Pose3 step = reference[k - 1].pose.inverse() * reference[k].pose;
    const Eigen::Vector3d up = reference[k].pose.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    step.rotation = step.rotation * so3_exp(up * (drift_deg_per_m / kDegPerRad * step.translation.norm()));
    step.translation *= 1.0 + scale;
    out.push_back(out.back() * step);
  }
  return out;
}

/// The covariance that a robot would claim for a step: 2 mm, 0.02 degrees, and the drift as a random walk that reaches
/// over half a submap (2.5 m) what the drift does.
inline Matrix6d step_covariance(double metres, const Options& options) {
  const double rotation = 0.02 / kDegPerRad, drift = options.drift_deg_per_m / kDegPerRad;
  Vector6d variance;
  variance.head<3>().setConstant(0.002 * 0.002 + options.scale * options.scale * metres * 2.5);
  variance.tail<3>().setConstant(rotation * rotation + drift * drift * metres * 2.5);
  return variance.asDiagonal();
}

struct Sample {
  Submap submap;
  lidar::SubmapFeatures features;
  std::vector<Pose3> reference;  // of its keyframes

  [[nodiscard]] const Pose3& reference_of(KeyframeId id) const {
    return reference[id.index - submap.keyframes.front().index];
  }
};

inline std::vector<Sample> build(const Session& session, const std::vector<Pose3>& odometry, RobotId robot,
                                 const Options& options) {
  std::vector<Sample> out;
  for (std::size_t first = 0, last = 0; first + 1 < odometry.size(); first = last) {
    while (last + 1 < odometry.size() &&
           session.reference[last].stamp - session.reference[first].stamp < kSubmapSeconds)
      ++last;
    Sample sample{.submap = {.id = {robot, static_cast<std::uint32_t>(out.size())}}};
    std::vector<lidar::PosedCloud> scans;
    for (std::size_t k = first; k <= last; ++k) {
      sample.submap.keyframes.push_back({static_cast<std::uint32_t>(k), session.reference[k].stamp, odometry[k]});
      sample.reference.push_back(session.reference[k].pose);
      scans.push_back({odometry[first].inverse() * odometry[k], session.clouds[k]});
      if (k == first) continue;
      const Pose3 step = odometry[k - 1].inverse() * odometry[k];
      sample.submap.odometry.push_back({step, step_covariance(step.translation.norm(), options)});
    }
    sample.submap.cloud = std::make_shared<PointCloud>(lidar::merge_scans(scans, 0.3, {0.5, 60.0}));
    out.push_back(std::move(sample));
  }
  return out;
}

inline std::vector<Sample> build_both(const Session& alpha, const Session& bravo, const Options& options) {
  Rng rng(options.seed);
  const double tilt = rng.uniform(0.0, 3.0) / kDegPerRad, about = rng.uniform(-std::numbers::pi, std::numbers::pi);
  const Eigen::Quaterniond turn = so3_exp({0, 0, rng.uniform(-std::numbers::pi, std::numbers::pi)});
  const Pose3 T_bravo_odom1{so3_exp({tilt * std::cos(about), tilt * std::sin(about), 0.0}) * turn,
                            {rng.uniform(-50, 50), rng.uniform(-50, 50), rng.uniform(-5, 5)}};
  auto out = build(alpha, degrade(alpha.reference, options.drift_deg_per_m, options.scale, alpha.reference[0].pose),
                   {0}, options);
  auto second =
      build(bravo,
            degrade(bravo.reference, -options.drift_deg_per_m, -options.scale, T_bravo_odom1 * bravo.reference[0].pose),
            {1}, options);
  std::move(second.begin(), second.end(), std::back_inserter(out));
  std::vector<double> ms;
  for (auto& sample : out) {
    const double start = cpu_ms();
    sample.features = lidar::extract_features(sample.submap, options.config);
    ms.push_back(cpu_ms() - start);
  }
  fmt::print("{} submaps, features {:.1f} ms median, {:.1f} ms worst\n", out.size(), percentile(ms, 0.5),
             percentile(ms, 1.0));
  return out;
}

}  // namespace tutti::bench
