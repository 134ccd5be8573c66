// SPDX-License-Identifier: BSD-3-Clause
#include "robust_summary.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "tutti/geometry/so3.hpp"

namespace tutti::app {
namespace {

using nlohmann::ordered_json;
using server::JudgedEdge;
using server::JudgedGraph;

/// How often each reason was given.
std::map<std::string, std::size_t> reasons(const JudgedGraph& judged) {
  std::map<std::string, std::size_t> out;
  for (const JudgedEdge& edge : judged.edges)
    if (!edge.odometry && !edge.accepted) ++out[to_string(edge.objection)];
  return out;
}

/// From where the solution with the least cost began.
const char* start_of(const server::MapEstimate& map) { return map.from_measurements ? "measurements" : "closures"; }

std::size_t count(const JudgedGraph& judged, bool odometry, bool accepted) {
  return static_cast<std::size_t>(std::ranges::count_if(judged.edges, [&](const JudgedEdge& edge) {
    return edge.odometry == odometry && (odometry || edge.accepted == accepted);
  }));
}

const std::string& name_at(const NamedGraph& graph, const server::FailedOdometry& failed, std::uint32_t index) {
  const KeyframeId id{failed.chain, index};
  return graph.names[static_cast<std::size_t>(std::ranges::lower_bound(graph.robots.vertices, id) -
                                              graph.robots.vertices.begin())];
}

ordered_json errors_json(const NamedGraph& graph, const MapErrors& errors) {
  ordered_json robots;
  for (std::size_t r = 0; r < errors.robots.size(); ++r)
    if (errors.robots[r]) robots[graph.robot_names[r]] = errors.robots[r]->rmse_m;
  return {{"joint", errors.joint->rmse_m}, {"robots_in_joint", errors.robots_in_joint}, {"robots", robots}};
}

void add_score(const NamedGraph& graph, const Score& score, ordered_json& out) {
  if (score.map.joint) out["ate_m"] = errors_json(graph, score.map);
  if (score.perfect) out["ate_m"]["perfect"] = errors_json(graph, *score.perfect);
  if (score.has_labels)
    out["closures"] = {{"right", score.right},
                       {"right_accepted", score.right_accepted},
                       {"wrong_accepted", score.accepted - score.right_accepted},
                       {"precision", score.precision()},
                       {"recall", score.recall()}};
}

void print_errors(const NamedGraph& graph, const MapErrors& errors, const char* heading, const char* remark) {
  fmt::print("{:<12} {:.3f} m of {} robots together ({});", heading, errors.joint->rmse_m, errors.robots_in_joint,
             remark);
  for (std::size_t r = 0; r < errors.robots.size(); ++r)
    if (errors.robots[r]) fmt::print(" {} {:.3f}", graph.robot_names[r], errors.robots[r]->rmse_m);
  fmt::print(" m by themselves\n");
}

void print_score(const NamedGraph& graph, const Score& score) {
  if (score.map.joint) print_errors(graph, score.map, "ATE", "RMSE after one alignment");
  if (score.perfect) print_errors(graph, *score.perfect, "  perfect", "least squares of the right closures");
  if (score.has_labels)
    fmt::print(
        "precision    {:.1f} % ({} of {} accepted are right)\nrecall       {:.1f} % ({} of {} right are accepted)\n",
        100.0 * score.precision(), score.right_accepted, score.accepted, 100.0 * score.recall(), score.right_accepted,
        score.right);
}

}  // namespace

void print_json(const RobustResult& result) {
  const auto& [graph, judged, score, time_s, cpu_s, is_stopped] = result;
  ordered_json out{{"robots", graph.robot_names},
                   {"robots_from", graph.robots_from},
                   {"stamps_from", graph.stamps_from},
                   {"poses", graph.names.size()},
                   {"odometry_edges", count(judged, true, true)},
                   {"replaced_matrices", graph.replaced},
                   {"repeated_edges", graph.repeated},
                   {"left_out", graph.left_out},
                   {"components", judged.map.components},
                   {"cost", judged.map.cost},
                   {"degrees_of_freedom", judged.map.degrees_of_freedom},
                   {"start", start_of(judged.map)},
                   {"accepted", count(judged, false, true)},
                   {"refused", count(judged, false, false)},
                   {"reasons", reasons(judged)},
                   {"failed_odometry", ordered_json::array()}};
  for (const auto& failed : judged.map.failed_odometry)
    out["failed_odometry"].push_back({{"from", name_at(graph, failed, failed.from)},
                                      {"to", name_at(graph, failed, failed.to)},
                                      {"missed_m", failed.jump_m},
                                      {"missed_deg", failed.jump_rad / kRadPerDeg}});
  add_score(graph, score, out);
  out["hypotheses"] = judged.map.work.hypotheses;
  out["factorisations"] = judged.map.work.factorisations;
  out["time_s"] = time_s;
  out["cpu_s"] = cpu_s;
  if (is_stopped) out["stopped"] = true;
  fmt::print("{}\n", out.dump(2));
}

void print_text(const RobustResult& result) {
  const NamedGraph& graph = result.graph;
  const JudgedGraph& judged = result.judged;
  fmt::print("robots       {} ({}), by {}\nposes        {}\nodometry     {} edges\ntimes        {}\ncomponents   {}\n",
             graph.robot_names.size(), fmt::join(graph.robot_names, " "), graph.robots_from, graph.names.size(),
             count(judged, true, true), graph.stamps_from, judged.map.components);
  fmt::print("cost         {:.1f}, {} degrees of freedom\n", judged.map.cost, judged.map.degrees_of_freedom);
  if (graph.replaced > 0)
    fmt::print("matrices     {} were not positive semidefinite; the nearest ones that are were taken\n",
               graph.replaced);
  if (graph.repeated > 0) fmt::print("repeated     {} edges are there twice and count once\n", graph.repeated);
  if (!graph.left_out.empty()) fmt::print("left out     {}\n", formats::counted(graph.left_out));
  fmt::print("closures     {} accepted, {} refused\n", count(judged, false, true), count(judged, false, false));
  for (const auto& [reason, times] : reasons(judged)) fmt::print("  {:>6}     {}\n", times, reason);
  for (const auto& failed : judged.map.failed_odometry)
    fmt::print("failed       odometry of {} from {} to {}: off by {:.2f} m, {:.1f} degrees\n",
               graph.robot_names[failed.chain.robot.value], name_at(graph, failed, failed.from),
               name_at(graph, failed, failed.to), failed.jump_m, failed.jump_rad / kRadPerDeg);
  print_score(graph, result.score);
  fmt::print("time         {:.1f} s{}\n", result.time_s,
             result.is_stopped ? ", then stopped: not all was tried that may be wrong" : "");
}

}  // namespace tutti::app
