// SPDX-License-Identifier: BSD-3-Clause
// Views from above: all robots in one map, and each robot's estimates on top of each other.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <span>

#include "tutti/mission/report/explanation.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"
#include "tutti/mission/report/map_pictures.hpp"
#include "tutti/mission/report/plot.hpp"

namespace tutti::mission {
namespace {

constexpr double kMapHalf_px = 560.0;

/// What the robots saw, as a picture under the routes.
void draw_clouds(Svg& svg, const PlanView& view, const GroundPlane& ground, std::vector<CloudLayer> clouds) {
  constexpr formats::Rgb kInk{112, 122, 140};
  if (clouds.empty()) return;
  PointRaster raster(static_cast<std::size_t>(kPixelRatio * view.width()),
                     static_cast<std::size_t>(kPixelRatio * view.height()));
  const Projection project = [&](const Eigen::Vector3d& p) {
    return std::optional<Eigen::Vector2d>(kPixelRatio * view(ground(p)));
  };
  for (CloudLayer& layer : clouds) {
    layer.colour = kInk;
    raster.add(layer, project, 2);
  }
  svg.image({0.0, 0.0}, {view.width(), view.height()}, data_uri(encode_png(raster.transparent())));
}

/// Wide strokes under a route where its odometry went wrong. `pixels`: one per pose of `route`.
void draw_drift(Svg& svg, const RobotRecord& robot, const Trajectory& route, const Points2d& pixels) {
  for (const DriftOrigin& origin : robot.drift_origins) {
    const auto [first, last] = stretch(route, origin.from, origin.until);
    svg.polyline(std::span(pixels).subspan(first, last - first), fmt::format("drift {}", drift_name(origin.kind)),
                 fmt::format("{}: {}, {}", robot.name, drift_name(origin.kind),
                             format_motion_error(origin.translation_m, origin.rotation_rad)));
  }
}

/// Invisible until pointed at.
void draw_hover_points(Svg& svg, const Points2d& pixels, const std::vector<std::string>& titles, std::size_t count) {
  const std::size_t step = std::max<std::size_t>(1, pixels.size() / count);
  for (std::size_t i = 0; i < std::min(pixels.size(), titles.size()); i += step)
    svg.circle(pixels[i], 6.0, "hover", titles[i]);
}

std::vector<std::string> route_titles(const RobotRecord& robot) {
  std::vector<std::string> out;
  for (const auto& p : robot.server_estimate)
    out.push_back(
        fmt::format("{} after {}", robot.name, format_mission_time(p.stamp - robot.server_estimate.front().stamp)));
  return out;
}

std::string component_figure(const MissionRecord& record, std::uint32_t component) {
  const Pose3 T_display_world = display_from_world(record, component);
  std::vector<const RobotRecord*> robots;
  for (const RobotRecord& robot : record.robots)
    if (robot.component == component) robots.push_back(&robot);
  const std::vector<Points3d> routes = displayed_routes(record, component);
  const GroundPlane ground = ground_plane(routes);
  std::vector<Points2d> layers;
  for (const auto& route : routes) layers.push_back(ground(route));
  std::vector<CloudLayer> clouds = server_layers(record, component);
  std::vector<Points2d> box = layers;
  box.push_back(cloud_corners(clouds, ground, layers));
  const PlanView view(box, kWide_px, 0.56 * kWide_px);
  Svg svg(view.width(), view.height(), "The joint map from above: every robot's trajectory in the server's estimate");
  draw_clouds(svg, view, ground, std::move(clouds));
  const auto [intra, inter] = closure_strokes(record, component, {T_display_world, ground, view});
  svg.segments(thinned(intra), "intra", fmt::format("{} loop closures within one robot", intra.size()));
  svg.segments(thinned(inter), "inter", fmt::format("{} loop closures between robots", inter.size()));
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const RobotRecord& robot = *robots[i];
    const std::string colour = robot_class(record, robot.id);
    const Points2d pixels = view(layers[i]);
    draw_drift(svg, robot, robot.server_estimate, pixels);
    svg.polyline(pixels, "route " + colour, robot.name);
    draw_hover_points(svg, pixels, route_titles(robot), detail_per_robot(record, 300, 20, 60));
  }
  for (std::size_t i = 0; i < robots.size(); ++i) {
    if (layers[i].empty()) continue;
    const RobotRecord& robot = *robots[i];
    const std::string colour = robot_class(record, robot.id);
    const double radius = 5.0 + 2.5 * static_cast<double>((robots.size() - 1 - i) % 4);  // rings around rings
    svg.circle(view(layers[i].front()), radius, "start " + colour, robot.name + " starts here");
    svg.circle(view(layers[i].back()), 4.0, "end " + colour, robot.name + " ends here");
    const bool below = i % 2 == 1;  // robots often start side by side: keep the names apart
    const bool left = i % 4 >= 2;
    svg.text(view(layers[i].front()) + Eigen::Vector2d(left ? -9.0 : 9.0, below ? 16.0 : -7.0), robot.name, "name",
             left ? "end" : "start");
  }
  view.draw_scale_bar(svg);
  return figure(svg.str(), "", "", true);
}

}  // namespace

std::string joint_map_html(const MissionRecord& record) {
  std::set<std::uint32_t> components;
  for (const auto& robot : record.robots)
    if (!robot.server_estimate.empty()) components.insert(robot.component);
  if (components.empty()) return "";
  std::vector<LegendEntry> legend;
  for (const auto& robot : record.robots) legend.push_back({"route " + robot_class(record, robot.id), robot.name});
  const ClosureCounts closures = count_closures(record.server);
  if (closures.accepted_inter > 0)
    legend.push_back({"inter", fmt::format("{} loop closures between robots", closures.accepted_inter)});
  if (closures.accepted_intra > 0)
    legend.push_back({"intra", fmt::format("{} loop closures within a robot", closures.accepted_intra)});
  if (!record.server.clouds.empty()) legend.push_back({"cloudkey", "what the robots saw"});
  for (auto& entry : drift_legend(record)) legend.push_back(std::move(entry));
  std::string body = legend_html(legend) + "<div class=\"figures\">\n";
  for (const std::uint32_t component : components) body += component_figure(record, component);
  return section("The joint map",
                 components.size() == 1
                     ? "Seen from above, in the server's final estimate. Rings are starts, dots are ends."
                     : "Seen from above, in the server's final estimate: one picture per group of robots, because the "
                       "groups never met and nobody knows how they lie to each other. Rings are starts, dots are ends.",
                 body + "</div>\n");
}

std::string robot_maps_html(const MissionRecord& record, const std::vector<RobotGeometry>& geometry) {
  if (record.robots.empty()) return "";
  const bool any_reference =
      std::any_of(geometry.begin(), geometry.end(), [](const RobotGeometry& g) { return g.has_reference; });
  std::vector<LegendEntry> legend{{"onboard", "onboard: raw odometry"},
                                  {"corrected", "corrected: robot with policy " + record.default_policy},
                                  {"server", "server"}};
  if (any_reference) legend.push_back({"reference", "reference"});
  std::vector<consistency::SuspectedOrigin> origins;
  for (const RobotRecord& robot : record.robots)
    if (robot.explanation)
      origins.insert(origins.end(), robot.explanation->origins.begin(), robot.explanation->origins.end());
  for (auto& entry : origin_legend(origins)) legend.push_back(std::move(entry));
  for (auto& entry : drift_legend(record)) legend.push_back(std::move(entry));
  std::string body = legend_html(legend) + "<div class=\"figures\">\n";
  for (std::size_t r = 0; r < record.robots.size(); ++r) {
    const RobotRecord& robot = record.robots[r];
    const RobotGeometry& g = geometry[r];
    if (g.onboard.empty()) continue;
    const GroundPlane ground = ground_plane({g.onboard, g.server, g.reference});
    const PlanView view(
        {ground(g.onboard), ground(g.corrected), ground(g.server), ground(g.reference), ground(g.whereabouts)},
        kMapHalf_px, 0.85 * kMapHalf_px);
    Svg svg(view.width(), view.height(), fmt::format("Estimates of {} from above", robot.name));
    svg.polyline(view(ground(g.server)), "server", "server");
    draw_drift(svg, robot, robot.odometry, view(ground(g.onboard)));
    if (robot.explanation)
      draw_origins(svg, robot.explanation->origins, robot.odometry, view(ground(g.onboard)),
                   {robot.odometry.front().stamp, robot.start_s}, view.width());
    svg.polyline(view(ground(g.onboard)), "onboard", "onboard");
    svg.polyline(view(ground(g.corrected)), "corrected", "corrected");
    svg.polyline(view(ground(g.reference)), "reference", "reference");
    std::vector<std::string> titles;
    for (const auto& e : g.errors)
      titles.push_back(fmt::format("{} after {}, {}: corrected {}, onboard {} off", robot.name,
                                   format_mission_time(e.time_s), format_distance(e.distance_m),
                                   format_metres(e.corrected_m), format_metres(e.onboard_m)));
    draw_hover_points(svg, view(ground(g.corrected.empty() ? g.onboard : g.corrected)), titles,
                      detail_per_robot(record, 300, 20, 60));
    for (std::size_t i = 0; i < g.whereabouts.size(); ++i) {
      const RobotId other = robot.whereabouts[i].other;
      const Eigen::Vector2d p = view(ground(g.whereabouts[i]));
      svg.circle(p, 6.0, "seen " + robot_class(record, other),
                 "where it believes " + robot_name(record, other) + " is");
      svg.text(p + Eigen::Vector2d(10.0, 4.0), robot_name(record, other), "name");
    }
    view.draw_scale_bar(svg);
    body += figure(svg.str(), robot.name,
                   fmt::format("{} in {}", format_distance(robot.distance_m), format_mission_time(robot.duration_s)),
                   false);
  }
  return section(
      "Each robot by itself",
      fmt::format("Every estimate is laid on the {} by one rigid alignment, without scale. Named rings: where "
                  "the robot believes the others to be at the end.",
                  any_reference ? "reference" : "server's estimate"),
      body + "</div>\n");
}

}  // namespace tutti::mission
