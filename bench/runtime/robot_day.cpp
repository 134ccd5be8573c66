// SPDX-License-Identifier: BSD-3-Clause
// A robot's long day, trajectory only: what it writes, keeps in memory, and how long a sample takes, hour by hour; its
// store an SQLite file. The server is played: now and then a proxy graph of all that the robot has, the odometry's
// drift taken out. Usage:
//   bench_robot_day HOURS METRES_PER_SECOND SAMPLES_PER_SECOND [MINUTES BETWEEN GRAPHS, 0: none [FOLDER]]
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/consistency/chain_uncertainty.hpp"
#include "tutti/node/robot_node.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/codec.hpp"

namespace {

using namespace tutti;

double resident_mb() {
  std::string text(4096, '\0');
  FILE* file = std::fopen("/proc/self/status", "r");
  text.resize(std::fread(text.data(), 1, text.size(), file));
  std::fclose(file);
  return 1e-3 * std::atof(text.c_str() + text.find("VmRSS:") + 6);
}

double now_ms() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// This thread's: what others do on the machine is not in it.
double cpu_ms() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

struct Hour {
  std::size_t rows = 0, row_bytes = 0, graph_bytes = 0, commits = 0;
  double worst_commit_ms = 0.0, worst_graph_ms = 0.0;
  std::vector<double> sample_ms;
};

constexpr RobotId kRobot{1};

/// Laps of 500 m, of which each drifts on.
Pose3 true_pose(double distance_m) {
  const double angle = distance_m / 80.0;
  return {Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ())),
          {80.0 * std::sin(angle), 80.0 * (1.0 - std::cos(angle)), 0.0}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    fmt::print(stderr, "usage: bench_robot_day HOURS M_PER_S SAMPLES_PER_S [MINUTES BETWEEN GRAPHS [FOLDER]]\n");
    return 2;
  }
  const double hours = std::atof(argv[1]), speed = std::atof(argv[2]), rate = std::atof(argv[3]);
  const double graphs_s = argc > 4 ? 60.0 * std::atof(argv[4]) : 0.0;
  const std::filesystem::path folder = argc > 5 ? argv[5] : std::filesystem::temp_directory_path();
  const auto file = folder / "robot_day.tutti";
  for (const char* end : {"", "-wal"}) std::filesystem::remove(file.string() + end);
  auto store = storage::open_sqlite_store(file, storage::robot_schema(), {.min_free_bytes = 0}).value();
  auto node = node::RobotNode::open(kRobot, 1, {}, *store).value();

  std::vector<Hour> day(1);
  const auto carry_out = [&](const node::Step& step) {
    for (const storage::Write& write : step.writes) {
      ++day.back().rows;
      if (write.bytes) day.back().row_bytes += write.key.size() + write.bytes->size();
    }
    if (step.writes.empty()) return;
    const double begin = now_ms();
    if (!store->commit(step.writes)) std::abort();
    day.back().worst_commit_ms = std::max(day.back().worst_commit_ms, now_ms() - begin);
    ++day.back().commits;
  };
  carry_out(node->resume({}));
  fmt::print(
      "| hour | MB of rows | of them graphs heard | rows | transactions | file, MB | memory, MB | sample p50, CPU ms | "
      "p99 | worst | commit, worst ms | graph, worst ms |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  Rng rng(1);
  const Matrix6d covariance = Vector6d(1e-5, 1e-5, 1e-6, 1e-8, 1e-8, 1e-7).asDiagonal() * (1.0 / rate);
  Pose3 T_odom_body;
  double next_graph_s = graphs_s;
  std::uint64_t revision = 0;
  const auto samples = static_cast<std::size_t>(hours * 3600.0 * rate);
  for (std::size_t i = 0; i < samples; ++i) {
    const double time_s = static_cast<double>(i) / rate;
    const Timestamp stamp = Timestamp{1'700'000'000'000'000'000LL} + time_s, now = Timestamp{} + time_s;
    if (i > 0) {
      Vector6d noise;
      for (int k = 0; k < 6; ++k) noise[k] = std::sqrt(covariance(k, k)) * rng.normal();
      const Pose3 step = true_pose((time_s - 1.0 / rate) * speed).inverse() * true_pose(time_s * speed);
      T_odom_body = retract(T_odom_body * step, noise);
    }
    const double begin = cpu_ms();
    const node::Step step = node->add(OdometrySample{stamp, T_odom_body, covariance}, now);
    day.back().sample_ms.push_back(cpu_ms() - begin);
    // The server has every submap at once.
    for (const bus::Envelope& message : step.messages) {
      const SubmapId id = wire::decode_submap(*message.bytes).value().submap.id;
      carry_out(step);
      Receipt receipt{.robot = kRobot, .stored = {}};
      for (std::uint32_t k = 0; k <= id.index; ++k) receipt.stored[id.chain.session].insert(k);
      carry_out(node->receive({bus::Endpoint::server(),
                               bus::Endpoint::of(kRobot),
                               bus::MessageKind::receipt,
                               {},
                               std::make_shared<const std::string>(wire::encode(receipt))},
                              now));
    }
    if (step.messages.empty()) carry_out(step);
    if (graphs_s > 0.0 && time_s >= next_graph_s) {
      next_graph_s += graphs_s;
      ProxyGraphMessage message;
      message.graph.revision = ++revision;
      const auto& agent = node->agent();
      for (const Keyframe& k : agent.keyframes())
        if (k.representative)
          message.graph.nodes.push_back(
              {.chain = agent.chain(),
               .stamp = k.stamp,
               .T_world_body = true_pose((k.stamp - Timestamp{1'700'000'000'000'000'000LL}) * speed),
               .covariance =
                   message.graph.nodes.empty() ? Matrix6d(Matrix6d::Zero()) : Matrix6d(1e-6 * Matrix6d::Identity())});
      message.graph.uncertainties = {
          consistency::even_uncertainty(agent.chain(), message.graph.nodes.size(), {0.05, 0.01})};
      message.graph.components = {{agent.chain(), 0}};
      const bus::Envelope envelope{bus::Endpoint::server(),
                                   bus::Endpoint::of(kRobot),
                                   bus::MessageKind::proxy_graph,
                                   {},
                                   std::make_shared<const std::string>(wire::encode(message))};
      const double began = now_ms();
      const node::Step updated = node->receive(envelope, now);
      day.back().worst_graph_ms = std::max(day.back().worst_graph_ms, now_ms() - began);
      for (const storage::Write& write : updated.writes)
        if (write.bytes && write.table == "journal") day.back().graph_bytes += write.bytes->size();
      carry_out(updated);
    }
    if (i + 1 == samples || static_cast<std::size_t>((time_s + 1.0 / rate) / 3600.0) + 1 > day.size()) {
      Hour& hour = day.back();
      std::ranges::sort(hour.sample_ms);
      fmt::print("| {} | {:.2f} | {:.2f} | {} | {} | {:.1f} | {:.0f} | {:.3f} | {:.3f} | {:.2f} | {:.1f} | {:.0f} |\n",
                 day.size(), 1e-6 * static_cast<double>(hour.row_bytes), 1e-6 * static_cast<double>(hour.graph_bytes),
                 hour.rows, hour.commits, 1e-6 * static_cast<double>(std::filesystem::file_size(file)), resident_mb(),
                 hour.sample_ms[hour.sample_ms.size() / 2], hour.sample_ms[hour.sample_ms.size() * 99 / 100],
                 hour.sample_ms.back(), hour.worst_commit_ms, hour.worst_graph_ms);
      std::fflush(stdout);
      hour.sample_ms = std::vector<double>();  // and its memory: this is the robot's table
      day.emplace_back();
    }
  }
  fmt::print("{} keyframes, {} links to the map\n", node->agent().keyframes().size(), node->agent().ledger().size());
  const double begin = now_ms();
  static_cast<void>(node->store_all());
  node.reset();
  node = node::RobotNode::open(kRobot, 1, {}, *store).value();
  fmt::print("a start on this store: {:.0f} ms, {} keyframes\n", now_ms() - begin, node->agent().keyframes().size());
}
