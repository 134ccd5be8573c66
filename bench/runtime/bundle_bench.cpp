// SPDX-License-Identifier: BSD-3-Clause
// Bundle adjustment of real visual submaps: EuRoC V1_01 as ROVIOLI tracked it, from its raw odometry. The error of the
// keyframes against ground truth stands beside the times; which pairs of submaps close is taken from ground truth.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "tutti/estimation/bundle/refine_map.hpp"
#include "tutti/estimation/bundle/relative_covariances.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/formats/maplab_submaps.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/perception/visual/visual_payload.hpp"

namespace tutti::bundle {
namespace {

const std::string kFolder = std::string(TUTTI_SHARED_DIR) + "/data/euroc/V1_01/";
constexpr std::size_t kKeyframesPerSubmap = 20;

std::shared_ptr<const Submap> submap_of(const formats::MaplabRecording& recording, std::uint32_t index,
                                        std::size_t first, std::size_t last) {
  auto submap = std::make_shared<Submap>();
  submap->id = {RobotId{0}, index};
  std::vector<visual::KeyframeImages> images;
  const Pose3 T_submap_odom = recording.odometry[first].pose.inverse();
  for (std::size_t k = first; k <= last; ++k) {
    const auto& [stamp, T_odom_body] = recording.odometry[k];
    const auto number = static_cast<std::uint32_t>(k);
    submap->keyframes.push_back({.index = number, .stamp = stamp, .T_odom_body = T_odom_body});
    images.push_back({number, T_submap_odom * T_odom_body, {recording.images[k]}});
    if (k > first)
      submap->odometry.push_back({recording.odometry[k - 1].pose.inverse() * T_odom_body, 1e-6 * Matrix6d::Identity()});
  }
  submap->visual = std::make_shared<const VisualPayload>(
      visual::make_visual_payload(images, recording.cameras, {.budget_kb = 1e6}).value());
  return submap;
}

struct Recording {
  Trajectory odometry, truth;
  RefinementInput input;
};

bool see_the_same(const Submap& a, const Submap& b, const Trajectory& truth) {
  const auto true_poses = [&](const Submap& submap) {
    Trajectory odometry;
    for (const auto& keyframe : submap.keyframes) odometry.push_back({keyframe.stamp, keyframe.T_odom_body});
    return evaluation::associate(odometry, truth, {});
  };
  const auto of_b = true_poses(b);
  for (const auto& one : true_poses(a))
    for (const auto& other : of_b) {
      const Pose3 T = one.reference.inverse() * other.reference;
      if (other.stamp - one.stamp > 5.0 && T.translation.norm() < 0.8 && rotation_angle(T) < 0.35) return true;
    }
  return false;
}

const Recording& recording() {
  static const Recording made = [] {
    std::vector<std::string> folders;
    for (int s = 0; s < 8; ++s) folders.push_back(kFolder + "maplab_submaps/submap_" + std::to_string(s));
    const auto maplab = formats::read_maplab_submaps(folders).value();
    Recording out{.odometry = maplab.odometry,
                  .truth = formats::read_trajectory(kFolder + "groundtruth.tum").value(),
                  .input = {}};
    auto& submaps = out.input.submaps;
    for (std::size_t first = 0; first + 1 < maplab.odometry.size(); first += kKeyframesPerSubmap - 1) {
      const std::size_t last = std::min(first + kKeyframesPerSubmap - 1, maplab.odometry.size() - 1);
      submaps.push_back({submap_of(maplab, static_cast<std::uint32_t>(submaps.size()), first, last), {}});
      for (const auto& keyframe : submaps.back().submap->keyframes)
        submaps.back().T_world_body.push_back(keyframe.T_odom_body);
    }
    for (std::size_t a = 0; a < submaps.size(); ++a)
      for (std::size_t b = a + 1; b < submaps.size(); ++b)
        if (see_the_same(*submaps[a].submap, *submaps[b].submap, out.truth))
          out.input.closed.push_back({submaps[a].submap->id, submaps[b].submap->id});
    return out;
  }();
  return made;
}

double ate_mm(const std::vector<BundleKeyframe>& keyframes) {
  Trajectory estimate;
  for (const auto& keyframe : keyframes)
    estimate.push_back({recording().odometry[keyframe.id.index].stamp, keyframe.T_world_body});
  return 1e3 * evaluation::ate(evaluation::associate(estimate, recording().truth, {})).value().rmse_m;
}

RefinementConfig config_of(const benchmark::State& state) {
  RefinementConfig config;
  config.merge.landmarks_per_keyframe = static_cast<int>(state.range(0));
  return config;
}

MergedMap merged(const RefinementConfig& config) {
  const auto& input = recording().input;
  return merge_landmarks(input.submaps, guided_matches(input.submaps, input.closed, config.matching), config.merge)
      .value();
}

void count(benchmark::State& state, const BundleProblem& problem) {
  state.counters["keyframes"] = static_cast<double>(problem.keyframes.size());
  state.counters["landmarks"] = static_cast<double>(problem.landmarks.size());
  state.counters["views"] = static_cast<double>(problem.observations.size());
}

/// The adjustment alone; the argument is how many landmarks a keyframe keeps (0 = all).
void BM_Adjust(benchmark::State& state) {
  const auto config = config_of(state);
  MergedMap map = merged(config);
  BundleSolution solution;
  for (auto _ : state) solution = make_ceres_bundle_adjuster(config.bundle)->adjust(map.problem).value();
  count(state, map.problem);
  state.counters["ate_before_mm"] = ate_mm(map.problem.keyframes);
  for (std::size_t k = 0; k < map.problem.keyframes.size(); ++k)
    map.problem.keyframes[k].T_world_body = solution.T_world_body[k];
  state.counters["ate_mm"] = ate_mm(map.problem.keyframes);
  state.counters["steps"] = solution.summary.iterations;
}
BENCHMARK(BM_Adjust)->Arg(0)->Arg(150)->Arg(80)->Unit(benchmark::kMillisecond);

void BM_Covariances(benchmark::State& state) {
  const auto config = config_of(state);
  const MergedMap map = merged(config);
  const auto solution = make_ceres_bundle_adjuster(config.bundle)->adjust(map.problem).value();
  for (auto _ : state) benchmark::DoNotOptimize(odometry_posterior(map.problem, solution, config.bundle));
  count(state, map.problem);
}
BENCHMARK(BM_Covariances)->Arg(0)->Arg(150)->Unit(benchmark::kMillisecond);

/// Matching, merging, adjustment and covariances.
void BM_RefineMap(benchmark::State& state) {
  RefinedMap refined;
  for (auto _ : state) refined = refine_map(recording().input, config_of(state)).value();
  state.counters["ate_mm"] = ate_mm(refined.keyframes);
}
BENCHMARK(BM_RefineMap)->Arg(0)->Arg(150)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace tutti::bundle

BENCHMARK_MAIN();
