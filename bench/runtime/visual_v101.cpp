// SPDX-License-Identifier: BSD-3-Clause
// Loop closures by appearance on the real ROVIO submaps of EuRoC V1_01, as three robots and as one, over RANSAC seeds:
// how many, how many wrong, how many of the revisiting keyframes are closed, how honest the covariances are. Ground
// truth: groundtruth.tum (body frame). Usage: bench_visual_v101 [seeds [submap duration in s [budget in kB]]]; with a
// budget, one descriptor per landmark.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <map>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "tutti/formats/maplab_submaps.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/perception/visual/verify.hpp"
#include "tutti/perception/visual/visual_payload.hpp"

namespace {

using namespace tutti;
using namespace tutti::visual;

constexpr double kWrong_m = 0.5, kWrong_deg = 5.0;                          // beyond which a relative pose is wrong
constexpr double kRevisit_m = 0.8, kRevisit_deg = 20.0, kRevisit_s = 15.0;  // as in the data's SOURCES file

template <class T>
T value(Result<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "{}\n", result.error().message);
  std::exit(1);
}

double degrees(const Pose3& T) { return rotation_angle(T) * 180.0 / std::numbers::pi; }

struct Settings {
  double duration_s = 18.0;
  VisualSubmapConfig payload;
};

/// 2 cm and 0.3 degrees from keyframe to keyframe, 1.1 s.
Matrix6d step_covariance() {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(0.02), Eigen::Vector3d::Constant(0.3 * std::numbers::pi / 180.0);
  return sigma.cwiseAbs2().asDiagonal();
}

Submap make_submap(SubmapId id, const formats::MaplabRecording& recording, std::size_t first, std::size_t last,
                   const Settings& settings) {
  Submap out{.id = id};
  std::vector<KeyframeImages> images;
  const Pose3 T_submap_odom = recording.odometry[first].pose.inverse();
  for (std::size_t k = first; k <= last; ++k) {
    const auto index = static_cast<std::uint32_t>(k);
    out.keyframes.push_back({index, recording.odometry[k].stamp, recording.odometry[k].pose});
    if (k > first)
      out.odometry.push_back(
          {recording.odometry[k - 1].pose.inverse() * recording.odometry[k].pose, step_covariance()});
    images.push_back({index, T_submap_odom * recording.odometry[k].pose, {recording.images[k]}});
  }
  out.visual =
      std::make_shared<const VisualPayload>(value(make_visual_payload(images, recording.cameras, settings.payload)));
  return out;
}

/// Adds one robot's; neighbours share a keyframe.
void add_submaps(RobotId robot, const formats::MaplabRecording& recording, const Settings& settings,
                 std::vector<Submap>& out) {
  std::uint32_t index = 0;
  std::size_t first = 0;
  const auto& odometry = recording.odometry;
  for (std::size_t k = 1; k < odometry.size(); ++k)
    if (odometry[k].stamp - odometry[first].stamp >= settings.duration_s || k + 1 == odometry.size()) {
      out.push_back(make_submap({robot, index++}, recording, first, k, settings));
      first = k;
    }
}

std::vector<Submap> submaps_of(const std::vector<std::vector<int>>& robots, const Settings& settings) {
  std::vector<Submap> out;
  for (std::uint32_t r = 0; r < robots.size(); ++r) {
    std::vector<std::string> folders;
    for (const int i : robots[r])
      folders.push_back(fmt::format(TUTTI_SHARED_DIR "/data/euroc/V1_01/maplab_submaps/submap_{}", i));
    add_submaps(RobotId{r}, value(formats::read_maplab_submaps(folders)), settings, out);
  }
  return out;
}

/// Keyframes by id with their true poses, and whether one of another candidate submap was nearly at the same place.
struct Truth {
  std::map<KeyframeId, Pose3> T_world_body;
  std::set<KeyframeId> revisiting;
};

std::vector<std::pair<const Submap*, const Submap*>> candidates(const std::vector<Submap>& submaps,
                                                                const VisualClosureConfig& config) {
  std::vector<std::pair<const Submap*, const Submap*>> out;
  for (std::size_t a = 0; a < submaps.size(); ++a)
    for (std::size_t b = a + 1; b < submaps.size(); ++b)
      if (is_candidate(submaps[a], submaps[b], 2, config)) out.emplace_back(&submaps[a], &submaps[b]);
  return out;
}

Truth truth_of(const std::vector<Submap>& submaps, const VisualClosureConfig& config) {
  const Trajectory reference = value(formats::read_trajectory(TUTTI_SHARED_DIR "/data/euroc/V1_01/groundtruth.tum"));
  Truth out;
  for (const Submap& submap : submaps)
    for (const Keyframe& keyframe : submap.keyframes)
      if (const auto pose = pose_at(reference, keyframe.stamp, 0.2))
        out.T_world_body[{submap.id.chain, keyframe.index}] = *pose;
  for (const auto& [a, b] : candidates(submaps, config))
    for (const Keyframe& k : a->keyframes)
      for (const Keyframe& l : b->keyframes) {
        const KeyframeId one{a->id.chain, k.index}, other{b->id.chain, l.index};
        if (!out.T_world_body.contains(one) || !out.T_world_body.contains(other)) continue;
        const Pose3 T = out.T_world_body[one].inverse() * out.T_world_body[other];
        if (std::abs(k.stamp - l.stamp) < kRevisit_s || T.translation.norm() > kRevisit_m || degrees(T) > kRevisit_deg)
          continue;
        out.revisiting.insert(one);
        out.revisiting.insert(other);
      }
  return out;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

struct Tally {
  std::size_t pairs = 0, closed_pairs = 0, closures = 0, wrong = 0;
  std::vector<double> errors_m, errors_deg, chi2_position, chi2_rotation, sigma_m;
  std::set<KeyframeId> closed;
  VerificationWork work;
};

void count(const LoopClosure& closure, const Truth& truth, Tally& tally) {
  const auto from = truth.T_world_body.find(closure.from), to = truth.T_world_body.find(closure.to);
  ++tally.closures;
  if (from == truth.T_world_body.end() || to == truth.T_world_body.end()) return;
  const Pose3 T_true = from->second.inverse() * to->second;
  const Vector6d error = local(T_true, closure.measurement.T_a_b);
  const double metres = error.head<3>().norm(), angle = error.tail<3>().norm() * 180.0 / std::numbers::pi;
  if (metres > kWrong_m || angle > kWrong_deg) {
    ++tally.wrong;
    fmt::print("  wrong: {}:{} to {}:{}, {:.2f} m, {:.1f} deg\n", to_string(closure.from.chain), closure.from.index,
               to_string(closure.to.chain), closure.to.index, metres, angle);
    return;
  }
  const Matrix6d& C = closure.measurement.covariance;
  tally.errors_m.push_back(metres);
  tally.errors_deg.push_back(angle);
  tally.chi2_position.push_back(
      squared_distance(Eigen::Vector3d(error.head<3>()), Eigen::Matrix3d(C.topLeftCorner<3, 3>())));
  tally.chi2_rotation.push_back(
      squared_distance(Eigen::Vector3d(error.tail<3>()), Eigen::Matrix3d(C.bottomRightCorner<3, 3>())));
  tally.sigma_m.push_back(std::sqrt(C.topLeftCorner<3, 3>().trace()));
  tally.closed.insert({closure.from, closure.to});
}

void report(const Tally& t, const Truth& truth, std::uint64_t seed, double seconds) {
  const auto closed =
      std::ranges::count_if(truth.revisiting, [&](const KeyframeId& k) { return t.closed.contains(k); });
  fmt::print(
      "seed {}: {} pairs, {} closed, {} closures, {} wrong; {} of {} revisiting keyframes closed ({:.0f} %); error "
      "median {:.3f} m {:.2f} deg, 90 % {:.3f} m {:.2f} deg; sigma median {:.4f} m; chi2 of 3 (2.37, 6.25 expected): "
      "position median {:.1f}, 90 % {:.1f}, rotation median {:.1f}, 90 % {:.1f}; {:.0f} ms of CPU a pair; of {} "
      "keyframes {} looked at "
      "closely, {:.0f} million distances, {} samples\n",
      seed, t.pairs, t.closed_pairs, t.closures, t.wrong, closed, truth.revisiting.size(),
      100.0 * static_cast<double>(closed) / static_cast<double>(truth.revisiting.size()), quantile(t.errors_m, 0.5),
      quantile(t.errors_deg, 0.5), quantile(t.errors_m, 0.9), quantile(t.errors_deg, 0.9), quantile(t.sigma_m, 0.5),
      quantile(t.chi2_position, 0.5), quantile(t.chi2_position, 0.9), quantile(t.chi2_rotation, 0.5),
      quantile(t.chi2_rotation, 0.9), 1e3 * seconds / static_cast<double>(t.pairs), t.work.keyframes, t.work.looked_at,
      1e-6 * static_cast<double>(t.work.distances), t.work.samples);
}

void run(const std::string& name, const std::vector<std::vector<int>>& robots, int seeds, const Settings& settings) {
  const auto submaps = submaps_of(robots, settings);
  VisualClosureConfig config{.min_time_apart_s = 5.0};
  const Truth truth = truth_of(submaps, config);
  std::size_t landmarks = 0, bits = 0;
  std::map<SubmapId, SubmapFeatures> features;
  for (const Submap& submap : submaps) {
    landmarks += submap.visual->landmarks.size();
    bits += submap.visual->descriptors.bits.size();
    features.emplace(submap.id, extract_features(submap, config));
  }
  fmt::print("{}: {} submaps, {} landmarks, {:.0f} kB of descriptors\n", name, submaps.size(), landmarks,
             8e-3 * static_cast<double>(bits));
  for (int seed = 0; seed < seeds; ++seed) {
    config.ransac_seed = static_cast<std::uint64_t>(seed);
    Tally tally;
    const std::clock_t start = std::clock();
    for (const auto& [a, b] : candidates(submaps, config)) {
      const auto verdict = verify_pair(features.at(a->id), features.at(b->id), config, &tally.work);
      ++tally.pairs;
      tally.closed_pairs += !verdict.closures.empty();
      for (const LoopClosure& closure : verdict.closures) count(closure, truth, tally);
    }
    report(tally, truth, config.ransac_seed, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 10;
  Settings settings;
  if (argc > 2) settings.duration_s = std::atof(argv[2]);
  if (argc > 3) settings.payload = {.one_descriptor_per_landmark = true, .budget_kb = std::atof(argv[3])};
  run("three robots", {{0, 1, 2}, {3, 4, 5}, {6, 7}}, seeds, settings);
  run("one robot", {{0, 1, 2, 3, 4, 5, 6, 7}}, seeds, settings);
}
