// SPDX-License-Identifier: BSD-3-Clause
// Multi-robot pose graphs made to COSMO-Bench's figures (3 to 5 robots, 2,000 to 4,400 poses, 4 to 19 % of the closures
// wrong, groups that agree among them), judged by `tutti optimise --robust` and by others. One JSON object per graph
// and method; with --write also the graphs as PyFG, with and without the wrong closures.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gnc_geman_mcclure.hpp"
#include "support/server/corridor_run.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/formats/pyfg.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/server/graph_judge.hpp"

namespace {

using namespace tutti;
using server::test::CorridorRun;
using server::test::CorridorRunConfig;

constexpr double kKeyframe_m = 2.0, kSpeed_mps = 1.4;
const std::vector<std::string> kOdometry = {"honest", "too sure", "fails once"};

struct Graph {
  std::string odometry;
  std::uint64_t seed = 1;
  server::RobotGraph robots;  ///< Poses: odometry, every robot from where it truly starts.
  std::vector<Pose3> truth;
  std::vector<bool> wrong;  ///< Per edge.
  std::size_t odometry_edges = 0;
};

CorridorRunConfig config_of(const std::string& odometry, std::uint64_t seed) {
  Rng rng = Rng(seed).fork("graphs");
  CorridorRunConfig config;
  config.robots = 3 + static_cast<std::uint32_t>(seed % 3);
  const double poses = rng.uniform(740.0, 900.0);  // of one robot
  config.world = {.rows = 4, .columns = 5, .block_m = 70.0, .jitter_m = 15.0};
  config.walk = {.duration_s = poses * kKeyframe_m / (0.9 * kSpeed_mps),
                 .rate_hz = 4.0,
                 .min_speed_mps = 0.8 * kSpeed_mps,
                 .max_speed_mps = kSpeed_mps,
                 .lookahead_m = 5.0};
  config.keyframe_m = kKeyframe_m;
  config.odometry.translation_m_per_sqrt_m = 0.03;
  config.odometry.yaw_deg_per_sqrt_m = 0.15;
  config.odometry.tilt_deg_per_sqrt_m = 0.03;
  config.odometry.stated_sigma_factor = odometry == "too sure" ? 1.0 / 3.0 : 1.0;
  config.closures = {.radius_m = 4.0, .sigma_m = 0.1, .sigma_deg = 1.0, .wrong_share = rng.uniform(0.04, 0.17)};
  const double until_s = config.walk.duration_s;
  if (seed % 2 == 0)  // a street similar to another one
    config.look_alikes = {{.first = {0},
                           .first_from_s = rng.uniform(0.1, 0.3) * until_s,
                           .second = {1},
                           .second_from_s = rng.uniform(0.5, 0.75) * until_s,
                           .length_s = 60.0}};
  if (odometry == "fails once")
    config.failures = {server::test::failure(0, 0.5 * until_s, 0.5 * until_s + rng.uniform(0.0, 10.0), 4.0, 4.0,
                                             rng.uniform(5.0, 25.0))};
  return config;
}

Graph make_graph(const std::string& odometry, std::uint64_t seed) {
  const CorridorRun run = server::test::corridor_run(config_of(odometry, seed), seed);
  Graph out{.odometry = odometry, .seed = seed, .robots = {}, .truth = {}, .wrong = {}};
  auto& [graph, vertices, stamps] = out.robots;
  const auto position = [&](const KeyframeId& id) {
    return static_cast<std::size_t>(std::ranges::lower_bound(vertices, id) - vertices.begin());
  };
  Pose3 T_world_odom;
  for (const auto& [id, submap] : run.submaps)
    for (const Keyframe& k : submap->keyframes) {
      const KeyframeId vertex{id.chain, k.index};
      if (!vertices.empty() && !(vertices.back() < vertex)) continue;
      out.truth.push_back(run.true_poses.at(vertex));
      if (k.index == 0) T_world_odom = out.truth.back() * k.T_odom_body.inverse();
      vertices.push_back(vertex);
      stamps.push_back(k.stamp);
      graph.poses.push_back(T_world_odom * k.T_odom_body);
    }
  const auto add = [&](const KeyframeId& from, const KeyframeId& to, const RelativePose& measured, bool wrong) {
    graph.edges.push_back({position(from), position(to), measured.T_a_b, inverse_of(measured.covariance)});
    out.wrong.push_back(wrong);
  };
  for (const auto& [id, submap] : run.submaps)
    for (std::size_t k = 0; k < submap->odometry.size(); ++k)
      add({id.chain, submap->keyframes[k].index}, {id.chain, submap->keyframes[k + 1].index}, submap->odometry[k],
          false);
  out.odometry_edges = graph.edges.size();
  Rng rng = Rng(seed).fork("found");
  const double found = rng.uniform(0.06, 0.3);  // of the closures there might be, as robots in radio range find them
  for (const auto& [pair, verdict] : run.verdicts)
    for (const LoopClosure& c : verdict.closures)
      if (rng.uniform(0.0, 1.0) < found) add(c.from, c.to, c.measurement, server::test::is_wrong(run, c));
  return out;
}

void write(const Graph& of, const std::string& folder) {
  formats::PyfgFile file;
  const auto& [graph, vertices, stamps] = of.robots;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const auto robot = static_cast<char>('A' + vertices[v].chain.robot.value);
    const bool is_first = vertices[v].index == 0;
    file.vertices.push_back(
        {{robot, vertices[v].index}, stamps[v], of.truth[v], is_first ? std::optional(of.truth[v]) : std::nullopt});
  }
  formats::PyfgFile right = file;
  for (std::size_t e = 0; e < graph.edges.size(); ++e) {
    const PoseGraphEdge& edge = graph.edges[e];
    file.edges.push_back({stamps[edge.to], edge.from, edge.to, {edge.T_from_to, inverse_of(edge.information)}});
    if (!of.wrong[e]) right.edges.push_back(file.edges.back());
  }
  std::string name = of.odometry;
  std::ranges::replace(name, ' ', '_');
  name = folder + "/" + name + "_" + std::to_string(of.seed);
  for (const auto& status :
       {formats::write_pyfg(name + ".pyfg", file), formats::write_pyfg(name + "_no_outliers.pyfg", right)})
    if (!status) throw std::runtime_error(status.error().message);
}

/// A method's result for a graph.
struct Outcome {
  std::vector<Pose3> poses;
  std::vector<bool> accepted;  ///< Per edge.
};

using Method = std::function<Outcome(const Graph&)>;

std::vector<estimation::EdgeRole> roles_of(const Graph& graph) {
  std::vector<estimation::EdgeRole> roles(graph.wrong.size(), estimation::EdgeRole::robust);
  std::fill_n(roles.begin(), graph.odometry_edges, estimation::EdgeRole::trusted);
  return roles;
}

Outcome robust(const Graph& graph, bool times_known) {
  server::RobotGraph robots = graph.robots;
  if (!times_known)
    for (std::size_t v = 0; v < robots.stamps.size(); ++v) robots.stamps[v] = Timestamp{} + robots.vertices[v].index;
  const server::JudgedGraph judged = server::judge_graph(robots, {});
  Outcome out;
  for (const auto& node : judged.map.nodes) out.poses.push_back(node.T_world_body);
  for (const auto& edge : judged.edges) out.accepted.push_back(edge.accepted);
  return out;
}

Outcome geman_mcclure(const Graph& graph) {
  auto solved = bench::solve_geman_mcclure(graph.robots.graph, roles_of(graph), {});
  return {std::move(solved.poses), std::move(solved.accepted)};
}

Outcome truncated(const Graph& graph) {
  const auto solved = estimation::solve_pose_graph_gnc(graph.robots.graph, {}, roles_of(graph));
  Outcome out{solved.solution.poses, {}};
  for (const double weight : solved.inlier_weight) out.accepted.push_back(weight >= 0.5);
  return out;
}

/// Least squares with the closures for which `keep` is true.
Outcome least_squares(const Graph& of, bool only_right) {
  PoseGraph graph = of.robots.graph;
  graph.edges.clear();
  Outcome out;
  for (std::size_t e = 0; e < of.wrong.size(); ++e) {
    out.accepted.push_back(!only_right || !of.wrong[e]);
    if (out.accepted.back()) graph.edges.push_back(of.robots.graph.edges[e]);
  }
  out.poses = estimation::solve_pose_graph(graph, {.initialisation = "given"}).poses;
  return out;
}

nlohmann::json judged(const Graph& graph, const std::string& name, const Method& method) {
  const auto before = std::chrono::steady_clock::now();
  const Outcome outcome = method(graph);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  std::vector<evaluation::PosePair> pairs;
  for (std::size_t v = 0; v < graph.truth.size(); ++v)
    pairs.push_back({graph.robots.stamps[v], outcome.poses[v], graph.truth[v]});
  std::size_t right = 0, right_accepted = 0, wrong_accepted = 0;
  for (std::size_t e = graph.odometry_edges; e < graph.wrong.size(); ++e) {
    right += graph.wrong[e] ? 0U : 1U;
    right_accepted += !graph.wrong[e] && outcome.accepted[e] ? 1U : 0U;
    wrong_accepted += graph.wrong[e] && outcome.accepted[e] ? 1U : 0U;
  }
  return {{"odometry", graph.odometry},
          {"seed", graph.seed},
          {"robots", graph.robots.vertices.back().chain.robot.value + 1},
          {"poses", graph.truth.size()},
          {"closures", graph.wrong.size() - graph.odometry_edges},
          {"right", right},
          {"method", name},
          {"ate_m", evaluation::ate(pairs)->rmse_m},
          {"right_accepted", right_accepted},
          {"wrong_accepted", wrong_accepted},
          {"seconds", seconds}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Multi-robot pose graphs made to COSMO-Bench's figures, and who makes what of them.");
  std::uint64_t seeds = 8;
  std::string folder;
  bool only_write = false;
  app.add_option("--seeds", seeds, "Graphs of every kind of odometry");
  app.add_option("--write", folder, "Write the graphs there, as PyFG");
  app.add_flag("--only-write", only_write, "Judge none");
  CLI11_PARSE(app, argc, argv);
  const std::vector<std::pair<std::string, Method>> methods = {
      {"robust", [](const Graph& graph) { return robust(graph, true); }},
      {"robust, 1 Hz", [](const Graph& graph) { return robust(graph, false); }},
      {"GNC-GM", geman_mcclure},
      {"GNC-TLS", truncated},
      {"all", [](const Graph& graph) { return least_squares(graph, false); }},
      {"only right", [](const Graph& graph) { return least_squares(graph, true); }}};
  if (!folder.empty()) std::filesystem::create_directories(folder);
  for (const std::string& odometry : kOdometry)
    for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
      const Graph graph = make_graph(odometry, seed);
      if (!folder.empty()) write(graph, folder);
      for (const auto& [name, method] : methods) {
        if (only_write) break;
        std::printf("%s\n", judged(graph, name, method).dump().c_str());
        std::fflush(stdout);
      }
    }
  return 0;
}
