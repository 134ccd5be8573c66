// SPDX-License-Identifier: BSD-3-Clause
// Time of each stage of a LiDAR loop closure on a furnished room, with the error of what came out beside it.
// bench_lidar_hku does the same on the real recordings.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numbers>

#include "support/perception/lidar/rooms.hpp"
#include "tutti/perception/lidar/candidates.hpp"
#include "tutti/perception/lidar/fft.hpp"
#include "tutti/perception/lidar/registration.hpp"
#include "tutti/perception/lidar/verify.hpp"

namespace {

using namespace tutti;
using namespace tutti::lidar;
using namespace tutti::lidar::test;

const LidarClosureConfig kConfig;
const Walk kWalkA, kWalkB{.from = {10, 4.5, 1.5}, .to = {6, 4.5, 1.5}, .yaw_rad = 2.5, .tilt_rad = 0.15};

struct Pair {
  Submap a = make_submap({RobotId{0}, 0}, furnished_room(), kWalkA, Rng(1));
  Submap b = make_submap({RobotId{1}, 0}, furnished_room(), kWalkB, Rng(2));
  SubmapFeatures features_a = extract_features(a, kConfig), features_b = extract_features(b, kConfig);
  Pose3 T_a_b = true_relative(kWalkA, kWalkB);
};

const Pair& pair() {
  static const Pair instance;
  return instance;
}

void report_error(benchmark::State& state, const Pose3& T_a_b) {
  const Vector6d error = local(pair().T_a_b, T_a_b);
  state.counters["error_mm"] = 1e3 * error.head<3>().norm();
  state.counters["error_mrad"] = 1e3 * error.tail<3>().norm();
}

void downsample(benchmark::State& state) {
  Rng rng(3);
  PointCloud cloud;
  for (int i = 0; i < 100000; ++i)
    cloud.points.emplace_back(static_cast<float>(rng.uniform(0, 20)), static_cast<float>(rng.uniform(0, 20)), 0.0F);
  std::size_t left = 0;
  for (auto _ : state) benchmark::DoNotOptimize(left = voxel_downsample(cloud, 0.3).points.size());
  state.counters["points_left"] = static_cast<double>(left);
}
BENCHMARK(downsample)->Unit(benchmark::kMillisecond);

void fft_forward(benchmark::State& state) {
  ComplexImage image = ComplexImage::Zero(kImageSize, kImageSize);
  image(0, 5) = 1.0F;
  ComplexImage spectrum;
  for (auto _ : state) benchmark::DoNotOptimize(spectrum = forward_fft(image));
  const double angle = -2.0 * std::numbers::pi * 5 * 7 / kImageSize;
  state.counters["error"] = std::abs(spectrum(0, 7).real() - std::cos(angle));
}
BENCHMARK(fft_forward)->Unit(benchmark::kMicrosecond);

void features(benchmark::State& state) {
  SubmapFeatures found;
  for (auto _ : state) benchmark::DoNotOptimize(found = extract_features(pair().b, kConfig));
  const Eigen::Vector3d up = found.R_level_submap.conjugate() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d truth = pose_on(kWalkB, 0).rotation.conjugate() * Eigen::Vector3d::UnitZ();
  state.counters["points"] = static_cast<double>(found.cloud.size());
  state.counters["tilt_error_mrad"] = 1e3 * (up - truth).norm();
}
BENCHMARK(features)->Unit(benchmark::kMillisecond);

void candidates(benchmark::State& state) {
  std::vector<AlignmentGuess> guesses;
  for (auto _ : state)
    benchmark::DoNotOptimize(guesses = propose_alignments(pair().features_a, pair().features_b, kConfig));
  report_error(state, guesses.front().T_a_b);
}
BENCHMARK(candidates)->Unit(benchmark::kMillisecond);

void registration(benchmark::State& state) {
  Vector6d start;
  start << 0.4, -0.3, 0.2, 0.02, -0.03, 0.05;
  const Pose3 T_init = retract(pair().T_a_b, start);
  RegistrationResult result;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        result = register_clouds(pair().features_a.cloud, pair().features_b.cloud, T_init, kConfig.registration));
  report_error(state, result.T_target_source);
  state.counters["iterations"] = result.iterations;
}
BENCHMARK(registration)->Unit(benchmark::kMillisecond);

void verify_same_room(benchmark::State& state) {
  PairVerification v;
  for (auto _ : state) benchmark::DoNotOptimize(v = verify_pair(pair().features_a, pair().features_b, kConfig));
  report_error(state, v.T_a_b);
  state.counters["accepted"] = v.accepted;
}
BENCHMARK(verify_same_room)->Unit(benchmark::kMillisecond);

void verify_other_room(benchmark::State& state) {
  const auto other = extract_features(make_submap({RobotId{1}, 1}, other_room(), {.yaw_rad = 1.0}, Rng(4)), kConfig);
  PairVerification v;
  for (auto _ : state) benchmark::DoNotOptimize(v = verify_pair(pair().features_a, other, kConfig));
  state.counters["accepted"] = v.accepted;  // must be 0
}
BENCHMARK(verify_other_room)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
