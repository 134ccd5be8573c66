// SPDX-License-Identifier: BSD-3-Clause
#include "optimise_robust.hpp"

#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <filesystem>
#include <iterator>

#include "options.hpp"
#include "progress_line.hpp"
#include "robust_score.hpp"
#include "robust_summary.hpp"
#include "tutti/base/file.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/pyfg.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/program/stop.hpp"

namespace tutti::app {
namespace {

using server::JudgedEdge;

std::size_t robot_of(const MapNode& node) { return node.id.chain.robot.value; }

std::string closures_beside(const std::string& output) {
  std::filesystem::path path(output);
  path.replace_filename(path.stem().string() + "_closures.csv");
  return path.string();
}

std::string closures_csv(const NamedGraph& graph, const server::JudgedGraph& judged, const GraphTruth& truth) {
  std::string out = fmt::format("from,to,accepted,reason{}\n", truth.right.empty() ? "" : ",right");
  for (std::size_t e = 0; e < judged.edges.size(); ++e) {
    const JudgedEdge& edge = judged.edges[e];
    if (edge.odometry) continue;
    const PoseGraphEdge& ends = graph.robots.graph.edges[e];
    fmt::format_to(std::back_inserter(out), "{},{},{},{}", graph.names[ends.from], graph.names[ends.to],
                   edge.accepted ? 1 : 0, judge::reason_of(edge.objection, edge.price));
    if (!truth.right.empty()) fmt::format_to(std::back_inserter(out), ",{}", truth.right[e] ? 1 : 0);
    out += '\n';
  }
  return out;
}

Status write_graph(const std::string& path, const NamedGraph& graph, const server::MapEstimate& map) {
  if (std::filesystem::path(path).extension() == ".g2o") {
    formats::G2oFile file{.graph = map.graph, .vertex_ids = graph.ids, .is_2d = graph.is_2d};
    for (std::size_t v = 0; v < graph.fixed_poses.size() && !graph.is_pyfg; ++v)
      if (graph.fixed_poses[v]) file.fixed.push_back(v);
    return formats::write_g2o(path, file);
  }
  formats::PyfgFile file;
  for (std::size_t v = 0; v < map.nodes.size(); ++v)
    file.vertices.push_back({{graph.names[v].front(), std::stoull(graph.names[v].substr(1))},
                             map.nodes[v].stamp,
                             map.nodes[v].T_world_body,
                             graph.fixed_poses[v]});
  for (const PoseGraphEdge& edge : map.graph.edges)
    file.edges.push_back(
        {map.nodes[edge.to].stamp, edge.from, edge.to, {edge.T_from_to, inverse_of(edge.information)}});
  return formats::write_pyfg(path, file);
}

/// The times that `tutti compare` reads beside a graph.
Status write_stamps(const std::string& path, const NamedGraph& graph, const server::MapEstimate& map) {
  std::vector<formats::VertexStamp> stamps;
  for (std::size_t v = 0; v < map.nodes.size(); ++v)
    stamps.push_back({graph.ids[v], map.nodes[v].id, map.nodes[v].stamp});
  return formats::write_graph_stamps(formats::stamps_beside(path), stamps);
}

Status write_trajectories(const std::string& folder, const NamedGraph& graph, const server::MapEstimate& map) {
  if (auto made = make_folder(folder); !made) return made;
  std::vector<Trajectory> trajectories(graph.robot_names.size());
  for (const auto& node : map.nodes) trajectories[robot_of(node)].push_back({node.stamp, node.T_world_body});
  for (std::size_t r = 0; r < trajectories.size(); ++r)
    if (auto written = formats::write_tum((std::filesystem::path(folder) / (graph.robot_names[r] + ".tum")).string(),
                                          trajectories[r]);
        !written)
      return written;
  return {};
}

Status write_all(const RobustOptions& options, const NamedGraph& graph, const server::JudgedGraph& judged,
                 const GraphTruth& truth) {
  if (auto ok = make_folder_of(options.output); !ok) return ok;
  if (auto ok = write_graph(options.output, graph, judged.map); !ok) return ok;
  if (auto ok = write_stamps(options.output, graph, judged.map); !ok) return ok;
  if (auto ok = write_file(closures_beside(options.output), closures_csv(graph, judged, truth)); !ok) return ok;
  return options.trajectories.empty() ? Status{} : write_trajectories(options.trajectories, graph, judged.map);
}

}  // namespace

int optimise_robust(const RobustOptions& options) {
  const auto ending = std::filesystem::path(options.output).extension();
  const auto graph = read_graph(options.source);
  if (!graph)
    return complain("optimise", graph.error().message, graph.error().code == ErrorCode::configuration ? 2 : 1);
  if (ending != ".g2o" && !(graph->is_pyfg && ending == ".pyfg"))
    return complain(
        "optimise",
        fmt::format("--output is {}, expected OUT.g2o{}", options.output, graph->is_pyfg ? " or OUT.pyfg" : ""), 2);
  const auto truth = read_truth(options.source, *graph);
  if (!truth) return complain("optimise", truth.error().message);
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();
  const auto judged = judge(*graph, options.source.path, counted_stop("decision"));
  const double cpu_s = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  const double time_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!judged) return complain("optimise", judged.error().message + "; nothing written");
  const Score scored = score(*graph, *judged, *truth);
  const RobustResult result{*graph, *judged, scored, time_s, cpu_s, program::stop_asked()};
  options.json ? print_json(result) : print_text(result);
  const auto written = write_all(options, *graph, *judged, *truth);
  return written ? 0 : complain("optimise", written.error().message);
}

}  // namespace tutti::app
