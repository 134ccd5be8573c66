// SPDX-License-Identifier: BSD-3-Clause
// The last broadcast, with the loop closures behind it and the constraints the robots took from it.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <tuple>

#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"
#include "tutti/mission/report/plot.hpp"

namespace tutti::mission {
namespace {

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

/// The largest component: others live in unrelated frames and would be drawn over it.
struct Plan {
  std::vector<std::uint32_t> component;  ///< Per proxy node.
  std::uint32_t shown = 0;
  MapView map;
  Points2d pixels;  ///< The proxy nodes'.
};

Plan plan_of(const MissionRecord& record) {
  const ProxyGraph& graph = record.server.proxy;
  const std::uint32_t shown = record.server.largest_component;
  const Pose3 T_display_world = display_from_world(record, shown);
  std::vector<std::uint32_t> component;
  Points3d box;
  for (const ProxyNode& node : graph.nodes) {
    component.push_back(component_of(graph, node.chain).value_or(0));
    if (component.back() == shown) box.push_back(T_display_world * node.T_world_body.translation);
  }
  const GroundPlane ground = ground_plane({box});
  Plan plan{std::move(component), shown, {T_display_world, ground, {{ground(box)}, kWide_px, 0.56 * kWide_px}}, {}};
  for (const ProxyNode& node : graph.nodes) plan.pixels.push_back(plan.map(node.T_world_body.translation));
  return plan;
}

void draw_edges(Svg& svg, const Plan& plan, const Edges& edges) {
  Strokes strokes;
  for (const auto& [a, b] : edges.shown)
    if (plan.component[a] == plan.shown) strokes.emplace_back(plan.pixels[a], plan.pixels[b]);
  svg.segments(strokes, "edge", fmt::format("{} of {} edges", edges.shown.size(), edges.total));
}

/// How many there are.
std::size_t draw_closures(Svg& svg, const Plan& plan, const MissionRecord& record) {
  auto [strokes, inter] = closure_strokes(record, plan.shown, plan.map);
  strokes.insert(strokes.end(), inter.begin(), inter.end());
  svg.segments(thinned(strokes), "closure", fmt::format("{} loop closures", strokes.size()));
  return strokes.size();
}

using PerKind = std::array<std::size_t, kKindName.size()>;

/// How many there are of each kind.
PerKind draw_constraints(Svg& svg, const Plan& plan, const MissionRecord& record) {
  PerKind kinds{};
  for (const auto& robot : record.robots) {
    const PolicyRecord* policy = find_policy(robot, record.default_policy);
    if (policy == nullptr || component_of(record.server.proxy, robot.id) != plan.shown) continue;
    std::array<Strokes, kKindName.size()> arcs;
    for (const auto& constraint : policy->constraints) {
      const Eigen::Vector3d* from = find_position(robot.server_estimate, constraint.from);
      const Eigen::Vector3d* to = find_position(robot.server_estimate, constraint.to);
      if (from == nullptr || to == nullptr) continue;
      arcs[static_cast<std::size_t>(constraint.kind)].emplace_back(plan.map(*from), plan.map(*to));
    }
    for (std::size_t k = 0; k < arcs.size(); ++k) {
      kinds[k] += arcs[k].size();
      svg.arcs(arcs[k], fmt::format("constraint {}", kKindClass[k]),
               fmt::format("{}: {} constraints, {}", robot.name, arcs[k].size(), kKindName[k]));
    }
  }
  return kinds;
}

void draw_nodes(Svg& svg, const Plan& plan, const MissionRecord& record) {
  const auto& graph_nodes = record.server.proxy.nodes;
  for (const auto& robot : record.robots) {
    Points2d nodes;
    for (std::size_t i = 0; i < graph_nodes.size(); ++i)
      if (graph_nodes[i].chain.robot == robot.id && plan.component[i] == plan.shown) nodes.push_back(plan.pixels[i]);
    svg.dots(nodes, "node " + robot_class(record, robot.id));
  }
}

}  // namespace

std::string proxy_graph_html(const MissionRecord& record) {
  const ProxyGraph& graph = record.server.proxy;
  if (graph.nodes.empty()) return "";
  const Plan plan = plan_of(record);
  const Edges edges = proxy_edges(graph, plan.component);
  Svg svg(plan.map.view.width(), plan.map.view.height(),
          "The proxy graph from above with loop closures and constraints");
  draw_edges(svg, plan, edges);
  const std::size_t closures = draw_closures(svg, plan, record);
  const PerKind kinds = draw_constraints(svg, plan, record);
  draw_nodes(svg, plan, record);
  plan.map.view.draw_scale_bar(svg);

  std::vector<LegendEntry> legend;
  for (const auto& robot : record.robots)
    legend.push_back({"route " + robot_class(record, robot.id), "nodes of " + robot.name});
  legend.push_back({"edge", fmt::format("edges (the {} heaviest of {})", edges.shown.size(), edges.total)});
  legend.push_back({"closure", fmt::format("{} loop closures", closures)});
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
