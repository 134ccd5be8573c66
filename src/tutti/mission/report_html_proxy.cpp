// SPDX-License-Identifier: BSD-3-Clause
// The last broadcast, with the loop closures behind it and the constraints the robots took from it.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <tuple>

#include "tutti/mission/report_format.hpp"
#include "tutti/mission/report_html_parts.hpp"
#include "tutti/mission/report_plot.hpp"

namespace tutti::mission {
namespace {

constexpr double kWide_px = 1160.0;
constexpr std::size_t kMaxEdges = 6000;
constexpr std::array<const char*, 4> kKindClass{"small", "mid", "large", "other"};
constexpr std::array<const char*, 4> kKindName{"small scale", "mid scale", "large scale", "chosen without scales"};

struct Edges {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> shown;
  std::size_t total = 0;
};

/// Carried edges of a reduced graph, otherwise the radius rule within each robot and between robots that share a frame;
/// of these the heaviest (shortest), three per node, at most kMaxEdges.
Edges proxy_edges(const ProxyGraph& graph, const std::vector<std::uint32_t>& component) {
  Edges out;
  std::vector<std::tuple<double, std::uint32_t, std::uint32_t>> all;
  const auto n = static_cast<std::uint32_t>(graph.nodes.size());
  if (graph.reduced) {
    for (const auto& edge : graph.edges)
      if (edge.a < n && edge.b < n) all.emplace_back(-edge.weight, edge.a, edge.b);
  } else {
    const double radius2 = graph.radius_m * graph.radius_m;
    for (std::uint32_t a = 0; a < n; ++a)
      for (std::uint32_t b = a + 1; b < n; ++b) {
        const double d2 =
            (graph.nodes[a].T_world_body.translation - graph.nodes[b].T_world_body.translation).squaredNorm();
        if (d2 < radius2 && component[a] == component[b]) all.emplace_back(d2, a, b);
      }
  }
  out.total = all.size();
  const std::size_t shown = std::min({all.size(), std::size_t{3} * n, kMaxEdges});
  std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(shown), all.end());
  for (std::size_t i = 0; i < shown; ++i) out.shown.emplace_back(std::get<1>(all[i]), std::get<2>(all[i]));
  return out;
}

std::uint32_t component_of(const ProxyGraph& graph, RobotId robot) {
  for (const auto& entry : graph.components)
    if (entry.robot == robot) return entry.component;
  return 0;
}

/// The component with most proxy nodes: others live in unrelated frames and would be drawn over each other.
std::uint32_t shown_component(const std::vector<std::uint32_t>& component) {
  std::uint32_t best = 0;
  std::ptrdiff_t most = 0;
  for (const std::uint32_t candidate : component) {
    const auto count = std::count(component.begin(), component.end(), candidate);
    if (count > most || (count == most && candidate < best)) std::tie(best, most) = std::pair(candidate, count);
    if (count * 2 > static_cast<std::ptrdiff_t>(component.size())) break;
  }
  return best;
}

}  // namespace

std::string proxy_graph_html(const MissionRecord& record) {
  const ProxyGraph& graph = record.server.proxy;
  if (graph.nodes.empty()) return "";
  std::vector<std::uint32_t> component;
  for (const auto& node : graph.nodes) component.push_back(component_of(graph, node.robot));
  const std::uint32_t shown = shown_component(component);

  const Pose3 T_display_world = record.server.T_reference_world.value_or(Pose3{});
  Points3d positions;
  for (const auto& node : graph.nodes) positions.push_back(T_display_world * node.T_world_body.translation);
  Points3d box;
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (component[i] == shown) box.push_back(positions[i]);
  const GroundPlane ground = ground_plane({box});
  const PlanView view({ground(box)}, kWide_px, 0.56 * kWide_px);
  const Points2d pixels = view(ground(positions));
  Svg svg(view.width(), view.height(), "The proxy graph from above with loop closures and constraints");

  const Edges edges = proxy_edges(graph, component);
  Strokes strokes;
  for (const auto& [a, b] : edges.shown)
    if (component[a] == shown) strokes.emplace_back(pixels[a], pixels[b]);
  svg.segments(strokes, "edge", fmt::format("{} of {} edges", edges.shown.size(), edges.total));

  const auto keyframes = keyframe_positions(record.server);
  Strokes closures;
  for (const auto& closure : record.server.closures) {
    const auto from = keyframes.find(closure.from);
    const auto to = keyframes.find(closure.to);
    if (from != keyframes.end() && to != keyframes.end() && component_of(graph, closure.from.robot) == shown)
      closures.emplace_back(view(ground(T_display_world * from->second)), view(ground(T_display_world * to->second)));
  }
  svg.segments(thinned(closures), "closure", fmt::format("{} loop closures", closures.size()));

  std::array<std::size_t, 4> kinds{};
  for (const auto& robot : record.robots) {
    const PolicyRecord* policy = find_policy(robot, record.default_policy);
    if (policy == nullptr || component_of(graph, robot.id) != shown) continue;
    std::array<Strokes, 4> arcs;
    for (const auto& constraint : policy->constraints) {
      const Eigen::Vector3d* from = find_position(robot.server_estimate, constraint.from);
      const Eigen::Vector3d* to = find_position(robot.server_estimate, constraint.to);
      if (from == nullptr || to == nullptr) continue;
      arcs[static_cast<std::size_t>(constraint.kind)].emplace_back(view(ground(T_display_world * *from)),
                                                                   view(ground(T_display_world * *to)));
    }
    for (std::size_t k = 0; k < arcs.size(); ++k) {
      kinds[k] += arcs[k].size();
      svg.arcs(arcs[k], fmt::format("constraint {}", kKindClass[k]),
               fmt::format("{}: {} constraints, {}", robot.name, arcs[k].size(), kKindName[k]));
    }
  }
  for (const auto& robot : record.robots) {
    Points2d nodes;
    for (std::size_t i = 0; i < pixels.size(); ++i)
      if (graph.nodes[i].robot == robot.id && component[i] == shown) nodes.push_back(pixels[i]);
    svg.dots(nodes, "node " + robot_class(record, robot.id));
  }
  view.draw_scale_bar(svg);

  std::vector<LegendEntry> legend;
  for (const auto& robot : record.robots)
    legend.push_back({"route " + robot_class(record, robot.id), "nodes of " + robot.name});
  legend.push_back({"edge", fmt::format("edges (the {} heaviest of {})", edges.shown.size(), edges.total)});
  legend.push_back({"closure", fmt::format("{} loop closures", closures.size())});
  for (std::size_t k = 0; k < kinds.size(); ++k)
    if (kinds[k] > 0)
      legend.push_back(
          {fmt::format("constraint {}", kKindClass[k]), fmt::format("{} constraints, {}", kinds[k], kKindName[k])});
  return section(
      "The proxy graph",
      fmt::format("Broadcast number {}: {} nodes{}. This is all a robot hears from the server; arcs are the relative "
                  "constraints that policy {} took from it.",
                  graph.revision, graph.nodes.size(),
                  graph.reduced ? fmt::format(", Kron-reduced from {}", graph.nodes.size() + graph.eliminated.size())
                                : std::string(),
                  record.default_policy),
      legend_html(legend) + "<div class=\"figures\">\n" + figure(svg.str(), "", "", true) + "</div>\n");
}

}  // namespace tutti::mission
