// SPDX-License-Identifier: BSD-3-Clause
// The memory of a mapping server after a mission of so many robots and minutes, per robot-hour, and where it
// goes: trajectories and, where the mission has them, images; the map in an SQLite file. Usage:
//   bench_server_memory MISSION.yaml ROBOTS MINUTES [SECONDS BETWEEN UPDATES [POINTS PER SUBMAP [MAP: it stays there]]]
//   bench_server_memory MISSION.yaml DATA-FOLDER [SETTING=VALUE ...]      as the mission has it: robots, trajectories
//   and closures
#include <fmt/format.h>
#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/robot/submap_builder.hpp"
#include "tutti/server/graph_monitor.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"
#include "tutti/wire/codec.hpp"

namespace {

using namespace tutti;

double heap_mb() { return 1e-6 * static_cast<double>(mallinfo2().uordblks + mallinfo2().hblkhd); }
double resident_mb(const char* field) {
  std::string text(4096, '\0');
  FILE* file = std::fopen("/proc/self/status", "r");
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  return 1e-3 * std::atof(text.c_str() + text.find(field) + std::string(field).size());
}

/// By how much more was resident while `call` ran than before it.
template <class Call>
auto with_peak(const char* what, double hours, Call&& call) {
  malloc_trim(0);
  if (FILE* file = std::fopen("/proc/self/clear_refs", "w"); file != nullptr) {
    std::fputs("5", file);  // what was most resident is forgotten
    std::fclose(file);
  }
  const double before = resident_mb("VmRSS:");
  auto result = call();
  const double peak = resident_mb("VmHWM:") - before;
  fmt::print("{:<28} {:>9} {:>9.2f} {:>16.2f}\n", what, "", peak, peak / hours);
  return result;
}

/// The submaps that robots would send, by the time at which each ends.
std::multimap<Timestamp, bus::Envelope> submaps_of(const mission::MissionInput& input,
                                                   const robot::SubmapConfig& config, int points) {
  Rng rng(1);
  std::multimap<Timestamp, bus::Envelope> out;
  for (const mission::MissionRecording& robot : input.robots) {
    const Recording& recording = robot.recording;
    robot::SubmapBuilder builder({recording.robot, 1}, config);
    const auto take = [&] {
      for (auto submap = builder.take_submap(); submap; submap = builder.take_submap()) {
        const Timestamp end = submap->keyframes.back().stamp;
        auto cloud = std::make_shared<PointCloud>();
        for (int i = 0; i < points; ++i)
          cloud->points.emplace_back(rng.uniform(-30.0, 30.0), rng.uniform(-30.0, 30.0), rng.uniform(0.0, 3.0));
        submap->cloud = std::move(cloud);
        const SubmapMessage message{{recording.robot, 1, submap->id.index}, std::move(*submap)};
        out.emplace(end, bus::Envelope{bus::Endpoint::of(recording.robot), bus::Endpoint::server(),
                                       bus::MessageKind::submap, node::message_id(message.submap.id),
                                       std::make_shared<const std::string>(wire::encode(message))});
      }
    };
    for (std::size_t i = 0; i < recording.odometry.size(); ++i) {
      const StampedPose& sample = recording.odometry[i];
      static_cast<void>(builder.add(OdometrySample{
          sample.stamp, sample.pose, i == 0 ? Matrix6d::Zero().eval() : recording.increment_covariance[i - 1]}));
      if (recording.visual) {
        const bool keyframe = builder.wants_scan();
        const TrackedImages images = recording.visual->images(i, keyframe);  // every one is tracked
        if (keyframe && !images.images.empty()) static_cast<void>(builder.add(images));
      }
      take();
    }
    builder.finish();
    take();
  }
  return out;
}

struct Part {
  const char* what;
  std::size_t count;
  double bytes;
};

std::vector<Part> parts_of(const server::MapServer& server, const ProxyGraph& graph) {
  constexpr double kNode = 48.0;  // of a std::map, with its allocation
  double submaps = 0, verdicts = 0;
  std::size_t keyframes = 0;
  for (const auto& [id, submap] : server.state().submaps) {
    keyframes += submap->keyframes.size();
    submaps += kNode + sizeof(Submap) +
               static_cast<double>(submap->keyframes.capacity() * sizeof(Keyframe) +
                                   submap->odometry.capacity() * sizeof(RelativePose));
  }
  for (const auto& [pair, verdict] : server.state().verdicts)
    verdicts +=
        kNode + sizeof(pair) + sizeof(verdict) + static_cast<double>(verdict.closures.capacity() * sizeof(LoopClosure));
  const server::MapEstimate& map = server.map();
  double uncertainties = 0;
  for (const ChainUncertainty& one : graph.uncertainties) {
    for (const ScaleUncertainty& scale : one.scales)
      uncertainties += static_cast<double>(scale.sigma.capacity() * sizeof(PoseSigma));
    uncertainties += sizeof(one);
  }
  const auto vector_bytes = [](const auto& v) { return static_cast<double>(v.capacity() * sizeof(v[0])); };
  return {{"submaps (keyframes)", keyframes, submaps},
          {"verdicts with closures", server.state().verdicts.size(), verdicts},
          {"answered pairs (stretches)", server.state().answered.intervals_beyond(),
           24.0 * static_cast<double>(server.state().answered.intervals_beyond() + server.state().submaps.size())},
          {"estimate: nodes", map.nodes.size(), vector_bytes(map.nodes) + vector_bytes(map.graph.poses)},
          {"estimate: edges", map.graph.edges.size(), vector_bytes(map.graph.edges)},
          {"estimate: closures", map.closures.size(), vector_bytes(map.closures)},
          {"proxy graph: nodes", graph.nodes.size(), vector_bytes(graph.nodes)},
          {"proxy graph: uncertainty", graph.uncertainties.size(), uncertainties}};
}

struct Arguments {
  std::string file, data;
  std::vector<std::string> settings;
  int points = 0;
  std::string keep;
};

void run(const Arguments& arguments) {
  const auto& [file, data, settings, points, keep] = arguments;
  const auto config = lab::load_mission(file, settings);
  if (!config) throw std::runtime_error(config.error().message);
  const auto input = lab::load_input(*config, data, 1);
  if (!input) throw std::runtime_error(input.error().message);
  double hours = 0.0;
  for (const auto& robot : input->robots)
    hours += (robot.recording.odometry.back().stamp - robot.recording.odometry.front().stamp) / 3600.0;
  const auto verifier = lab::make_closure_verifier(*config, input->robots, 1);
  auto arrivals = submaps_of(*input, config->agent.submap, points);
  std::set<RobotId> ids;
  for (const auto& robot : input->robots) ids.insert(robot.recording.robot);

  const auto path = keep.empty() ? std::filesystem::temp_directory_path() / fmt::format("server_memory_{}", getpid())
                                 : std::filesystem::path(keep);
  auto store = storage::open_sqlite_store(path, storage::map_schema(), {.min_free_bytes = 0}).value();
  malloc_trim(0);
  const double heap_before = heap_mb(), resident_before = resident_mb("VmRSS:");
  const auto refiner = verifiers::make_refiner(config->closures, config->refinement);
  auto node = node::ServerNode::open(ids, verifier, {.server = config->server, .refiner = refiner}, 1, *store).value();
  const auto frames = node::SubmapFrames::of(*store);
  node::WorkerNode worker(bus::Endpoint::worker(0), verifier, frames);
  worker.refine_with(refiner);
  std::size_t pairs = 0;
  const std::function<void(node::Step)> carry_out = [&](node::Step step) {
    if (auto ok = store->commit(step.writes); !ok) throw std::runtime_error(ok.error().message);
    for (const bus::Envelope& message : step.messages) {
      const bool verifies = message.kind == bus::MessageKind::job;
      if (!verifies && message.kind != bus::MessageKind::refinement_job) continue;
      if (verifies) pairs += wire::decode_job(*message.bytes)->pairs.size();
      node::WorkerNode here = worker;
      for (const bus::Envelope& answer : here.receive(message, {}).messages) carry_out(node->receive(answer, {}));
    }
  };
  Timestamp now;
  double peak_in_update = 0.0;
  const auto update = [&] {
    now = node->next_timer().value_or(now);
    carry_out(node->on_timer(now));
    peak_in_update = std::max(peak_in_update, resident_mb("VmHWM:"));
  };
  carry_out(node->resume(now));
  const Timestamp begin = arrivals.begin()->first;
  for (const auto& [time, envelope] : arrivals) {
    const Timestamp at = Timestamp{} + (time - begin);
    while (node->next_timer() && *node->next_timer() <= at) update();
    now = std::max(now, at);
    carry_out(node->receive(envelope, now));
  }
  if (node->next_timer()) update();
  malloc_trim(0);
  const double heap = heap_mb() - heap_before;
  fmt::print("{} robots: {:.3f} robot-hours, {} submaps, {} pairs verified\n", input->robots.size(), hours,
             node->map_server().state().submaps.size(), pairs);
  fmt::print("{:<28} {:>9} {:>9} {:>16}\n", "", "count", "MB", "MB/robot-hour");
  double known = 0.0;
  for (const Part& part : parts_of(node->map_server(), node->broadcast())) {
    known += 1e-6 * part.bytes;
    fmt::print("{:<28} {:>9} {:>9.2f} {:>16.2f}\n", part.what, part.count, 1e-6 * part.bytes,
               1e-6 * part.bytes / hours);
  }
  fmt::print("{:<28} {:>9} {:>9.2f} {:>16.2f}\n", "other heap (worker's features)", "", heap - known,
             (heap - known) / hours);
  fmt::print("{:<28} {:>9} {:>9.2f} {:>16.2f}\n", "heap in all", "", heap, heap / hours);
  fmt::print("{:<28} {:>9} {:>9.2f} {:>16.2f}\n", "resident", "", resident_mb("VmRSS:") - resident_before,
             (resident_mb("VmRSS:") - resident_before) / hours);
  fmt::print("{:<28} {:>9} {:>9.2f} {:>16.2f}\n", "most resident, in an update", "", peak_in_update - resident_before,
             (peak_in_update - resident_before) / hours);
  const server::MapServerState& state = node->map_server().state();
  const auto map = with_peak("  of it, estimating the map", hours, [&] {
    return server::estimate_map(state.submaps, state.verdicts, config->server.map, state.decisions);
  });
  static_cast<void>(with_peak("  of it, the proxy graph", hours,
                              [&] { return server::monitor_graph(map, 1, config->server.proxy_graph); }));
  node.reset();
  store.reset();
  if (keep.empty()) std::filesystem::remove(path);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    fmt::print(
        "usage: bench_server_memory MISSION.yaml ROBOTS MINUTES [SECONDS BETWEEN UPDATES [POINTS PER SUBMAP [MAP]]]\n"
        "       bench_server_memory MISSION.yaml DATA-FOLDER [SETTING=VALUE ...]\n");
    return 2;
  }
  Arguments arguments{.file = argv[1]};
  if (std::filesystem::is_directory(argv[2])) {
    arguments.data = argv[2];
    arguments.settings.assign(argv + 3, argv + argc);
  } else {
    const double minutes = argc > 3 ? std::atof(argv[3]) : 30.0;
    arguments.settings = {fmt::format("simulation.robots.0.copies={}", std::atoi(argv[2])),
                          fmt::format("simulation.robots.0.walk.duration_s={}", 60.0 * minutes),
                          fmt::format("server.update_least_s={}", argc > 4 ? std::atof(argv[4]) : 20.0)};
    arguments.points = argc > 5 ? std::atoi(argv[5]) : 0;
    arguments.keep = argc > 6 ? argv[6] : "";
  }
  try {
    run(arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_server_memory: {}\n", error.what());
    return 1;
  }
  return 0;
}
