// SPDX-License-Identifier: BSD-3-Clause
// How long a server takes to start again on a large map: until it is ready, until its first update is made, and what of
// the map it reads for that. Usage:
//   bench_large_map MISSION.yaml MAP SUBMAPS [POINTS PER SUBMAP [CANDIDATES PER SUBMAP]]   makes one, then measures
//   bench_large_map MISSION.yaml MAP                                                       measures on what is there
// The map is of simulated robots of half an hour each, as many as it takes. Every pair of submaps has been looked at,
// as with scans whose places are not known: those near each other have the closures of the mission's verifier, the
// others were refused. With candidates it is only the nearest that were, and a tenth of these have closures, as in a
// large fleet with scans.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/mapfile/content.hpp"
#include "tutti/node/decisions.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/robot/submap_builder.hpp"
#include "tutti/server/candidate_pairs.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/codec.hpp"

namespace {

using namespace tutti;

constexpr double kWalk_s = 1800.0;
constexpr double kFar_m = 25.0;  // submaps that begin so far apart see nothing of each other
constexpr std::size_t kPairsPerRow = 256;
constexpr std::size_t kRowsPerCommit = 2000;

/// As a LiDAR place's.
constexpr std::size_t kPlaceBytes = 4105;

/// As one that compares scans: every pair is worth a check that is a candidate.
class EveryPair final : public server::ClosureVerifier {
 public:
  static MethodId who() { return {"large_map", 1, 1}; }
  [[nodiscard]] MethodId id() const override { return who(); }
  [[nodiscard]] bool can_compare(const PayloadSize&, const PayloadSize&) const override { return true; }
  [[nodiscard]] bool is_candidate(const Submap&, const Submap&) const override { return true; }
  [[nodiscard]] bool can_rank(std::string_view place) const override { return place.size() == kPlaceBytes; }
  [[nodiscard]] Result<ClosureVerdict> verify(const Submap&, const Submap&,
                                              const server::PayloadStore&) const override {
    return fail(ErrorCode::unsupported, "nothing is verified here");
  }
};

/// Commits rows in batches.
class Writer {
 public:
  explicit Writer(storage::TableStore& store) : store_(store) {}
  void put(storage::Write row) {
    rows_.push_back(std::move(row));
    if (rows_.size() >= kRowsPerCommit) flush();
  }
  void flush() {
    if (auto ok = store_.commit(rows_); !ok) throw std::runtime_error(ok.error().message);
    rows_.clear();
  }

 private:
  storage::TableStore& store_;
  std::vector<storage::Write> rows_;
};

std::shared_ptr<const PointCloud> any_cloud(Rng& rng, int points) {
  if (points == 0) return nullptr;
  auto cloud = std::make_shared<PointCloud>();
  for (int i = 0; i < points; ++i)
    cloud->points.emplace_back(rng.uniform(-30.0, 30.0), rng.uniform(-30.0, 30.0), rng.uniform(0.0, 3.0));
  return cloud;
}

/// In the order in which they would come from robots that walk at the same time: which pairs are candidates when they
/// come, and are displaced later, depends on it. Without their clouds; in the store with them.
std::vector<Submap> write_submaps(const mission::MissionInput& input, const robot::SubmapConfig& config,
                                  std::size_t most, int points, Writer& writer) {
  Rng rng(1);
  std::vector<Submap> all;
  for (const mission::MissionRecording& robot : input.robots) {
    const Recording& recording = robot.recording;
    robot::SubmapBuilder builder({recording.robot, 1}, config);
    for (std::size_t i = 0; i < recording.odometry.size() && all.size() < most; ++i) {
      const StampedPose& sample = recording.odometry[i];
      static_cast<void>(builder.add(OdometrySample{
          sample.stamp, sample.pose, i == 0 ? Matrix6d::Zero().eval() : recording.increment_covariance[i - 1]}));
      for (auto submap = builder.take_submap(); submap && all.size() < most; submap = builder.take_submap()) {
        all.push_back(*submap);
        submap->cloud = any_cloud(rng, points);
        const SubmapId id = submap->id;
        const SubmapMessage message{{recording.robot, 1, id.index}, std::move(*submap)};
        writer.put({"submaps", node::key_of(id), wire::encode(message)});
      }
    }
  }
  std::ranges::stable_sort(all, {}, [](const Submap& submap) { return submap.keyframes.back().stamp; });
  return all;
}

Eigen::Vector3d begin_of(const Submap& submap, const mission::MissionInput& input) {
  const Trajectory& reference = input.robots.at(submap.id.chain.robot.value).recording.reference;
  const auto at = std::ranges::lower_bound(reference, submap.keyframes.front().stamp, {}, &StampedPose::stamp);
  return (at == reference.end() ? reference.back() : *at).pose.translation;
}

/// Which earlier submaps each was compared with: all, or the nearest when it came.
class Compared {
 public:
  Compared(const std::vector<Submap>& all, const std::vector<Eigen::Vector3d>& begin, std::size_t candidates)
      : all_(all), begin_(begin), candidates_(candidates) {}
  /// Those that submap `b` was compared with, increasing; writes its place where there are candidates.
  std::vector<std::size_t> with(std::size_t b, Writer& writer) {
    std::vector<std::size_t> out(b);
    std::iota(out.begin(), out.end(), std::size_t{0});
    at_.emplace(all_[b].id, b);
    if (candidates_ == 0) return out;
    std::vector<server::Alike> others;
    for (const std::size_t a : out) others.push_back({all_[a].id, -(begin_[a] - begin_[b]).norm()});
    server::Place place{std::string(kPlaceBytes, '\0'), true, pairs_.add(all_[b].id, others)};
    for (std::size_t i = 0; i < kPlaceBytes; ++i) place.looks[i] = static_cast<char>(rng_.index(256));
    out.clear();
    for (const server::Alike& other : place.candidates) out.push_back(at_.at(other.submap));
    writer.put(node::to_row(all_[b].id, place));
    return out;
  }
  [[nodiscard]] bool may_close() { return candidates_ == 0 || rng_.index(10) == 0; }

 private:
  const std::vector<Submap>& all_;
  const std::vector<Eigen::Vector3d>& begin_;
  std::size_t candidates_;
  server::CandidatePairs pairs_{candidates_};
  std::map<SubmapId, std::size_t> at_;
  Rng rng_{1};
};

void make_map(const lab::MissionConfig& config, const std::filesystem::path& file, std::size_t submaps, int points,
              std::size_t candidates) {
  const auto input = lab::load_input(config, "", 1);
  if (!input) throw std::runtime_error(input.error().message);
  const auto verifier = lab::make_closure_verifier(config, input->robots, 1);
  auto store = storage::open_sqlite_store(file, storage::map_schema(), {.min_free_bytes = 0}).value();
  const auto nothing = node::SubmapFrames::of(*store);
  Writer writer(*store);
  const std::vector<Submap> all = write_submaps(*input, config.agent.submap, submaps, points, writer);
  std::vector<Eigen::Vector3d> begin;
  for (const Submap& submap : all) begin.push_back(begin_of(submap, *input));
  std::size_t jobs = 0, closed = 0, asked = 0;
  Verdicts refused;
  const auto end_job = [&] {
    if (refused.verdicts.empty()) return;
    refused.job = fmt::format("1/1/{}", jobs++);
    writer.put({"answers", refused.job, wire::encode(refused)});
    refused.verdicts.clear();
  };
  Compared compared(all, begin, candidates);
  for (std::size_t b = 0; b < all.size(); ++b) {
    for (const std::size_t a : compared.with(b, writer)) {
      ++asked;
      const bool is_in_order = all[a].id < all[b].id;
      const Submap &first = all[is_in_order ? a : b], &second = all[is_in_order ? b : a];
      ClosureVerdict verdict{
          .pair = {first.id, second.id}, .closures = {}, .refusal = Refusal{RefusalReason::unlike_from_above}};
      if ((begin[a] - begin[b]).norm() < kFar_m && compared.may_close() && verifier->is_candidate(first, second))
        verdict = verifier->verify(first, second, *nothing).value();
      verdict.verifier = EveryPair::who();
      if (!verdict.refusal) {
        ++closed;
        writer.put({"verdicts", node::key_of(verdict.pair), wire::encode(verdict)});
        continue;
      }
      refused.verdicts.push_back(std::move(verdict));
      if (refused.verdicts.size() == kPairsPerRow) end_job();
    }
    end_job();
  }
  writer.put(node::to_row(node::MapMeta{.epoch = 1, .revision = 1, .news = false, .start = 1}));
  writer.put(node::to_row(config.server));
  writer.flush();
  fmt::print("{} submaps of {} robots, {} points each, {} pairs asked, closures between {} of them\n", all.size(),
             input->robots.size(), points, asked, closed);
}

/// Wall and CPU seconds of a call, printed.
template <class Call>
auto timed(const char* what, Call&& call) {
  const auto begin = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  auto result = call();
  fmt::print("{:<40} {:>8.2f} s {:>8.2f} s of CPU\n", what,
             std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(),
             static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC);
  std::fflush(stdout);
  return result;
}

void measure(const lab::MissionConfig& config, const std::filesystem::path& file) {
  fmt::print("{}: {:.1f} MB\n", file.string(), 1e-6 * static_cast<double>(std::filesystem::file_size(file)));
  auto store = timed("the file is open", [&] {
    return storage::open_sqlite_store(file, storage::map_schema(), {.min_free_bytes = 0}).value();
  });
  auto node = timed("what is stored is read", [&] {
    return node::ServerNode::open({}, std::make_shared<EveryPair>(), {.server = config.server, .accepts_others = true},
                                  1, *store)
        .value();
  });
  const auto resumed = timed("its first step: it is ready", [&] { return node->resume({}); });
  const MissionStatus status = node->mission_status({});
  fmt::print("{} submaps, {} closures, {} components, {} messages of the first step\n", status.submaps, status.closures,
             status.components, resumed.messages.size());
  const auto updated = timed("the map is computed",
                             [&] { return node->next_timer() ? node->on_timer(*node->next_timer()) : node::Step(); });
  fmt::print("{} messages\n", updated.messages.size());
  node.reset();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print("usage: bench_large_map MISSION.yaml MAP [SUBMAPS [POINTS PER SUBMAP [CANDIDATES PER SUBMAP]]]\n");
    return 2;
  }
  try {
    const std::size_t submaps = argc > 3 ? static_cast<std::size_t>(std::atoll(argv[3])) : 0;
    const std::size_t per_robot = static_cast<std::size_t>(kWalk_s / 10.0) - 1;
    const auto config =
        lab::load_mission(argv[1], {fmt::format("simulation.robots.0.copies={}", submaps / per_robot + 1),
                                    fmt::format("simulation.robots.0.walk.duration_s={}", kWalk_s)});
    if (!config) throw std::runtime_error(config.error().message);
    const std::filesystem::path file = argv[2];
    if (submaps > 0)
      timed("the map is made", [&] {
        make_map(*config, file, submaps, argc > 4 ? std::atoi(argv[4]) : 0,
                 argc > 5 ? static_cast<std::size_t>(std::atoll(argv[5])) : 0);
        return 0;
      });
    measure(*config, file);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_large_map: {}\n", error.what());
    return 1;
  }
  return 0;
}
