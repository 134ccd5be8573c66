// SPDX-License-Identifier: BSD-3-Clause
#include "optimise_robust.hpp"

#include <fmt/ranges.h>

#include <chrono>
#include <filesystem>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "options.hpp"
#include "tutti/base/file.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/formats/g2o.hpp"
#include "tutti/formats/graph_stamps.hpp"
#include "tutti/formats/pyfg.hpp"
#include "tutti/formats/trajectory_file.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::app {
namespace {

using nlohmann::ordered_json;
using server::JudgedEdge;

/// Against the truth: RMSE of positions after one alignment of all robots of the largest component, and of each robot
/// by itself; and how many closures were classified right.
struct Score {
  std::optional<evaluation::AteResult> joint;
  std::size_t robots_in_joint = 0;
  std::vector<std::optional<evaluation::AteResult>> robots;
  std::size_t right = 0, accepted = 0, right_accepted = 0;
  bool has_labels = false;

  [[nodiscard]] double precision() const { return share(right_accepted, accepted); }
  [[nodiscard]] double recall() const { return share(right_accepted, right); }

 private:
  static double share(std::size_t of, std::size_t all) {
    return all == 0 ? 1.0 : static_cast<double>(of) / static_cast<double>(all);
  }
};

std::size_t robot_of(const MapNode& node) { return node.id.chain.robot.value; }

std::uint32_t largest_component(const server::MapEstimate& map) {
  std::map<std::uint32_t, std::size_t> sizes;
  for (const auto& node : map.nodes) ++sizes[node.component];
  return std::ranges::max_element(sizes, {}, [](const auto& of) { return of.second; })->first;
}

Score score(const NamedGraph& graph, const server::JudgedGraph& judged, const GraphTruth& truth) {
  Score out;
  const auto& nodes = judged.map.nodes;
  const std::uint32_t largest = largest_component(judged.map);
  std::vector<evaluation::PosePair> joint;
  std::vector<std::vector<evaluation::PosePair>> robots(graph.robot_names.size());
  std::vector<bool> is_in_joint(graph.robot_names.size(), false);
  for (std::size_t v = 0; v < truth.poses.size(); ++v) {
    if (!truth.poses[v]) continue;
    const evaluation::PosePair pair{nodes[v].stamp, nodes[v].T_world_body, *truth.poses[v]};
    robots[robot_of(nodes[v])].push_back(pair);
    if (nodes[v].component != largest) continue;
    joint.push_back(pair);
    is_in_joint[robot_of(nodes[v])] = true;
  }
  out.joint = evaluation::ate(joint);
  out.robots_in_joint = static_cast<std::size_t>(std::ranges::count(is_in_joint, true));
  for (const auto& pairs : robots) out.robots.push_back(evaluation::ate(pairs));
  out.has_labels = !truth.right.empty();
  for (std::size_t e = 0; e < truth.right.size(); ++e) {
    if (judged.edges[e].odometry) continue;
    out.right += truth.right[e] ? 1U : 0U;
    out.accepted += judged.edges[e].accepted ? 1U : 0U;
    out.right_accepted += truth.right[e] && judged.edges[e].accepted ? 1U : 0U;
  }
  return out;
}

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
    file.edges.push_back({map.nodes[edge.to].stamp, edge.from, edge.to, {edge.T_from_to, edge.information.inverse()}});
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

/// How often each reason was given.
std::map<std::string, std::size_t> reasons(const server::JudgedGraph& judged) {
  std::map<std::string, std::size_t> out;
  for (const JudgedEdge& edge : judged.edges)
    if (!edge.odometry && !edge.accepted) ++out[to_string(edge.objection)];
  return out;
}

std::size_t count(const server::JudgedGraph& judged, bool odometry, bool accepted) {
  return static_cast<std::size_t>(std::ranges::count_if(judged.edges, [&](const JudgedEdge& edge) {
    return edge.odometry == odometry && (odometry || edge.accepted == accepted);
  }));
}

const std::string& name_at(const NamedGraph& graph, const server::FailedOdometry& failed, std::uint32_t index) {
  const KeyframeId id{failed.chain, index};
  return graph.names[static_cast<std::size_t>(std::ranges::lower_bound(graph.robots.vertices, id) -
                                              graph.robots.vertices.begin())];
}

ordered_json to_json(const NamedGraph& graph, const server::JudgedGraph& judged, const Score& score, double time_s) {
  ordered_json out{{"robots", graph.robot_names},
                   {"robots_from", graph.robots_from},
                   {"stamps_from", graph.stamps_from},
                   {"poses", graph.names.size()},
                   {"odometry_edges", count(judged, true, true)},
                   {"replaced_matrices", graph.replaced},
                   {"components", judged.map.components},
                   {"accepted", count(judged, false, true)},
                   {"refused", count(judged, false, false)},
                   {"reasons", reasons(judged)},
                   {"failed_odometry", ordered_json::array()}};
  for (const auto& failed : judged.map.failed_odometry)
    out["failed_odometry"].push_back({{"from", name_at(graph, failed, failed.from)},
                                      {"to", name_at(graph, failed, failed.to)},
                                      {"missed_m", failed.jump_m},
                                      {"missed_deg", failed.jump_rad / kRadPerDeg}});
  if (score.joint) {
    ordered_json robots;
    for (std::size_t r = 0; r < score.robots.size(); ++r)
      if (score.robots[r]) robots[graph.robot_names[r]] = score.robots[r]->rmse_m;
    out["ate_m"] = {{"joint", score.joint->rmse_m}, {"robots_in_joint", score.robots_in_joint}, {"robots", robots}};
  }
  if (score.has_labels)
    out["closures"] = {{"right", score.right},
                       {"right_accepted", score.right_accepted},
                       {"wrong_accepted", score.accepted - score.right_accepted},
                       {"precision", score.precision()},
                       {"recall", score.recall()}};
  out["time_s"] = time_s;
  return out;
}

void print_score(const NamedGraph& graph, const Score& score) {
  if (score.joint) {
    fmt::print("ATE          {:.3f} m of {} robots together (RMSE after one alignment);", score.joint->rmse_m,
               score.robots_in_joint);
    for (std::size_t r = 0; r < score.robots.size(); ++r)
      if (score.robots[r]) fmt::print(" {} {:.3f}", graph.robot_names[r], score.robots[r]->rmse_m);
    fmt::print(" m by themselves\n");
  }
  if (score.has_labels)
    fmt::print(
        "precision    {:.1f} % ({} of {} accepted are right)\nrecall       {:.1f} % ({} of {} right are accepted)\n",
        100.0 * score.precision(), score.right_accepted, score.accepted, 100.0 * score.recall(), score.right_accepted,
        score.right);
}

void print(const NamedGraph& graph, const server::JudgedGraph& judged, const Score& score, double time_s) {
  fmt::print("robots       {} ({}), by {}\nposes        {}\nodometry     {} edges\ntimes        {}\ncomponents   {}\n",
             graph.robot_names.size(), fmt::join(graph.robot_names, " "), graph.robots_from, graph.names.size(),
             count(judged, true, true), graph.stamps_from, judged.map.components);
  if (graph.replaced > 0)
    fmt::print("matrices     {} were not positive semidefinite; the nearest ones that are were taken\n",
               graph.replaced);
  fmt::print("closures     {} accepted, {} refused\n", count(judged, false, true), count(judged, false, false));
  for (const auto& [reason, times] : reasons(judged)) fmt::print("  {:>6}     {}\n", times, reason);
  for (const auto& failed : judged.map.failed_odometry)
    fmt::print("failed       odometry of {} from {} to {}: off by {:.2f} m, {:.1f} degrees\n",
               graph.robot_names[failed.chain.robot.value], name_at(graph, failed, failed.from),
               name_at(graph, failed, failed.to), failed.jump_m, failed.jump_rad / kRadPerDeg);
  print_score(graph, score);
  fmt::print("time         {:.1f} s\n", time_s);
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
  const auto judged = judge(*graph, options.source.path);
  const double time_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!judged) return complain("optimise", judged.error().message + "; nothing written");
  const Score scored = score(*graph, *judged, *truth);
  if (options.json)
    fmt::print("{}\n", to_json(*graph, *judged, scored, time_s).dump(2));
  else
    print(*graph, *judged, scored, time_s);
  const auto written = write_all(options, *graph, *judged, *truth);
  return written ? 0 : complain("optimise", written.error().message);
}

}  // namespace tutti::app
