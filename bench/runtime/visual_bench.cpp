// SPDX-License-Identifier: BSD-3-Clause
// Time of each stage of a visual loop closure in a simulated room, and of the first check of a keyframe against 10,000
// others, with the error of what came out beside it. bench_visual_v101 does the closures on a real recording.
#include <benchmark/benchmark.h>

#include <cmath>

#include "support/perception/visual/textured_room.hpp"
#include "tutti/perception/visual/hamming.hpp"
#include "tutti/perception/visual/matching.hpp"
#include "tutti/perception/visual/p3p.hpp"
#include "tutti/perception/visual/verify.hpp"

namespace {

using namespace tutti;
using namespace tutti::visual;
using namespace tutti::visual::test;

const auto kCameras = stereo_cameras();
const Flight kFlightA;
const Flight kFlightB{.from = {4.6, 2.6, 1.5}, .to = {2.4, 2.4, 1.4}, .yaw_rad = 1.7};

const std::vector<RoomPoint>& room() {
  static const auto instance = textured_room(1200, Rng(1));
  return instance;
}

void hamming_100000(benchmark::State& state) {
  Rng rng(1);
  Descriptors rows{.kind = DescriptorKind::maplab, .words = kWords};
  for (int i = 0; i < 100000; ++i)
    for (const std::uint64_t word : random_bits(rng)) rows.bits.push_back(word);
  const Bits query(rows.row(77777).begin(), rows.row(77777).end());
  std::vector<NearRow> found;
  for (auto _ : state) rows_within(query, rows, 61, found);
  state.counters["right"] = found.size() == 1 && found[0].row == 77777 ? 1.0 : 0.0;
}
BENCHMARK(hamming_100000)->Unit(benchmark::kMillisecond);

void payload_of_a_submap(benchmark::State& state) {
  const Seen seen = fly(room(), kCameras, kFlightA, Rng(1));
  VisualPayload payload;
  for (auto _ : state) payload = *make_visual_payload(seen.images, kCameras, {});
  state.counters["landmarks"] = static_cast<double>(payload.landmarks.size());
}
BENCHMARK(payload_of_a_submap)->Unit(benchmark::kMillisecond);

void three_points(benchmark::State& state) {
  std::array<Eigen::Vector3d, 3> points{{{0.3, 0.2, 3.0}, {-0.5, 0.1, 2.0}, {0.1, -0.4, 4.0}}}, directions;
  for (std::size_t i = 0; i < 3; ++i) directions[i] = points[i].normalized();
  std::vector<Pose3> solutions;
  for (auto _ : state) benchmark::DoNotOptimize(solutions = p3p(directions, points));
  double error = 1e9;
  for (const Pose3& T : solutions) error = std::min(error, local(Pose3{}, T).norm());
  state.counters["error"] = error;
}
BENCHMARK(three_points);

/// Another room: nothing but the first check.
void verify_a_hopeless_pair(benchmark::State& state) {
  const VisualClosureConfig config;
  const auto other_room = textured_room(1200, Rng(2));
  const auto a =
      extract_features(make_submap({RobotId{0}, 0}, fly(room(), kCameras, kFlightA, Rng(1)), kCameras), config);
  const auto b =
      extract_features(make_submap({RobotId{1}, 0}, fly(other_room, kCameras, kFlightB, Rng(2)), kCameras), config);
  ClosureVerdict verdict;
  for (auto _ : state) verdict = verify_pair(a, b, config);
  state.counters["closures"] = static_cast<double>(verdict.closures.size());
  state.counters["descriptors"] = static_cast<double>(a.descriptors.size());
}
BENCHMARK(verify_a_hopeless_pair)->Unit(benchmark::kMillisecond);

void verify_a_pair(benchmark::State& state) {
  const VisualClosureConfig config;
  const auto a =
      extract_features(make_submap({RobotId{0}, 0}, fly(room(), kCameras, kFlightA, Rng(1)), kCameras), config);
  const auto b =
      extract_features(make_submap({RobotId{1}, 0}, fly(room(), kCameras, kFlightB, Rng(2)), kCameras), config);
  ClosureVerdict verdict;
  for (auto _ : state) verdict = verify_pair(a, b, config);
  double worst = 0.0;
  for (const LoopClosure& closure : verdict.closures) {
    const Pose3 T_true = true_pose(kFlightA, closure.from.index).inverse() * true_pose(kFlightB, closure.to.index);
    worst = std::max(worst, local(T_true, closure.measurement.T_a_b).head<3>().norm());
  }
  state.counters["closures"] = static_cast<double>(verdict.closures.size());
  state.counters["worst_mm"] = 1e3 * worst;
}
BENCHMARK(verify_a_pair)->Unit(benchmark::kMillisecond);

// --- a place among 10,000 keyframes of 200 descriptors ---

constexpr std::uint32_t kKeyframes = 10000, kPerKeyframe = 200;
constexpr std::uint32_t kPerSubmap = 20;  // as on V1_01

/// A descriptor of a submap's place: every keyframe of it sees most of them, each time a little different.
Bits seen_again(std::uint32_t submap, std::uint32_t point, double flips, Rng& rng) {
  Rng its = Rng(7).fork((std::uint64_t{submap} << 32U) | point);
  Bits out = random_bits(its);
  for (std::uint64_t& word : out)
    for (int bit = 0; bit < 64; ++bit) word ^= static_cast<std::uint64_t>(rng.bernoulli(flips)) << bit;
  return out;
}

/// `share` of the descriptors are of the place, the others of nothing.
Descriptors observe(std::uint32_t submap, double share, Rng& rng) {
  Descriptors out{.kind = DescriptorKind::maplab, .words = kWords};
  for (std::uint32_t i = 0; i < kPerKeyframe; ++i) {
    const Bits bits = rng.bernoulli(share) ? seen_again(submap, static_cast<std::uint32_t>(rng.index(300)), 0.06, rng)
                                           : random_bits(rng);
    out.bits.insert(out.bits.end(), bits.begin(), bits.end());
  }
  return out;
}

/// Submaps of so many keyframes, all of whose descriptors are of landmarks.
const std::vector<SubmapFeatures>& all_submaps() {
  static const std::vector<SubmapFeatures> instance = [] {
    std::vector<SubmapFeatures> out(kKeyframes / kPerSubmap);
    Rng rng(1);
    for (std::uint32_t s = 0; s < out.size(); ++s) {
      Descriptors& rows = out[s].landmark_descriptors;
      rows = {.kind = DescriptorKind::maplab, .words = kWords};
      for (std::uint32_t k = 0; k < kPerSubmap; ++k) {
        const Descriptors its = observe(s, 0.7, rng);
        rows.bits.insert(rows.bits.end(), its.bits.begin(), its.bits.end());
      }
      out[s].tables = DescriptorTables(table_keys(rows));
    }
    return out;
  }();
  return instance;
}

/// As the server asks: the keyframes of one submap at one submap after the other.
void place_among_10000(benchmark::State& state) {
  const auto& submaps = all_submaps();
  const VisualClosureConfig config;
  Rng rng(2);
  SubmapFeatures query;  // whose keyframes are each at another place
  std::vector<std::uint32_t> places;
  query.descriptors = {.kind = DescriptorKind::maplab, .words = kWords};
  for (std::uint32_t k = 0; k < kPerSubmap; ++k) {
    places.push_back(static_cast<std::uint32_t>(rng.index(submaps.size())));
    const Descriptors its = observe(places.back(), 0.3, rng);
    QueryFrame image;
    for (std::uint32_t i = 0; i < kPerKeyframe; ++i) image.observations.push_back({.descriptor = kPerKeyframe * k + i});
    query.keyframes.push_back({.frames = {image}});
    query.descriptors.bits.insert(query.descriptors.bits.end(), its.bits.begin(), its.bits.end());
  }
  query.keys = table_keys(query.descriptors);
  std::size_t right = 0, kept = 0;
  for (auto _ : state) {
    right = kept = 0;
    for (std::uint32_t s = 0; s < submaps.size(); ++s)
      for (std::uint32_t k = 0; k < kPerSubmap; ++k) {
        const bool looks_alike = count_near(query.keyframes[k], query, submaps[s], config, 4) >= 4;
        kept += looks_alike;
        right += looks_alike && s == places[k];
      }
  }
  state.counters["right"] = static_cast<double>(right) / kPerSubmap;
  state.counters["kept"] = static_cast<double>(kept) / kPerSubmap;
  state.counters["ms_each"] = benchmark::Counter(
      1e-3 * kPerSubmap, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(place_among_10000)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
