// SPDX-License-Identifier: BSD-3-Clause
// Who drifted where and when: errors over mission time, true and suspected origins of drift, constraints.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/mission/report/explanation.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"
#include "tutti/mission/report/plot.hpp"

namespace tutti::mission {
namespace {

constexpr double kDriftLeft_px = 78.0;
constexpr double kDriftRight_px = 14.0;
constexpr std::string_view kTimeAxis = "mission time [s]";

/// Logarithmic when a linear axis would press the smaller curves onto the floor.
bool wants_logarithm(const std::vector<RobotGeometry>& geometry) {
  std::vector<double> corrected;
  double largest = 0.0;
  for (const auto& g : geometry)
    for (const auto& e : g.errors) {
      if (std::isfinite(e.onboard_m)) largest = std::max(largest, e.onboard_m);
      if (std::isfinite(e.corrected_m)) corrected.push_back(e.corrected_m);
    }
  const auto middle = spread(corrected);
  return middle && middle->median > 0.0 && largest > 12.0 * middle->median;
}

/// What all robots' plots share, so that they can be compared.
struct Common {
  Range time_s;
  Range error_m;
  Range born_m;
  bool logarithmic = false;
  std::size_t hover_points = 0;
};

/// Bands from the top to the bottom of the plot.
void draw_bands(Svg& svg, const MissionRecord& record, const RobotRecord& robot, const Axis& x, double top,
                double bottom) {
  constexpr double kThinnestMark_px = 1.5;
  const auto band = [&](Timestamp from, Timestamp until, const std::string& css_class, const std::string& title) {
    const double left = x(mission_clock(robot)(from));
    svg.rect({left, top}, {std::max(kThinnestMark_px, x(mission_clock(robot)(until)) - left), bottom - top}, css_class,
             title);
  };
  for (const DriftOrigin& origin : robot.drift_origins)
    band(origin.from, origin.until, fmt::format("drift {}", drift_name(origin.kind)), format_drift(origin));
  for (const FailedOdometryRecord& failed : record.server.failed_odometry)
    if (failed.robot == robot.id)
      band(failed.from, failed.until, "suspect",
           "suspected by the server: " + format_motion_error(failed.error_m, failed.error_rad));
}

void draw_errors(Svg& svg, const RobotGeometry& g, const Axis& x, const Axis& y, std::size_t hover_points) {
  const auto curve = [&](double KeyframeError::*value, const std::string& css_class, const std::string& title) {
    Points2d points;
    for (const auto& e : g.errors) points.emplace_back(x(e.time_s), y(e.*value));
    svg.polyline(points, "curve " + css_class, title);
  };
  curve(&KeyframeError::server_m, "server", "server");
  curve(&KeyframeError::onboard_m, "onboard", "onboard");
  curve(&KeyframeError::corrected_m, "corrected", "corrected");
  const std::size_t step = std::max<std::size_t>(1, g.errors.size() / hover_points);
  for (std::size_t i = 0; i < g.errors.size(); i += step) {
    const KeyframeError& e = g.errors[i];
    svg.circle({x(e.time_s), y(std::isfinite(e.corrected_m) ? e.corrected_m : e.onboard_m)}, 6.0, "hover",
               fmt::format("after {} ({}): onboard {}, corrected {}, server {}", format_mission_time(e.time_s),
                           format_distance(e.distance_m), format_metres(e.onboard_m), format_metres(e.corrected_m),
                           format_metres(e.server_m)));
  }
}

/// A stroke at both ends of every constraint.
void draw_constraints(Svg& svg, const MissionRecord& record, const RobotRecord& robot, const Axis& x, double top,
                      double bottom) {
  const PolicyRecord* policy = find_policy(robot, record.default_policy);
  if (policy == nullptr) return;
  std::vector<double> ends_s;
  for (const ConstraintRecord& c : policy->constraints)
    for (const Timestamp end : {c.from, c.to}) ends_s.push_back(mission_clock(robot)(end));
  std::sort(ends_s.begin(), ends_s.end());
  ends_s.erase(std::unique(ends_s.begin(), ends_s.end()), ends_s.end());
  Strokes strokes;
  for (const double end_s : ends_s) strokes.push_back({{x(end_s), top}, {x(end_s), bottom}});
  svg.segments(thinned(strokes), "mark held", fmt::format("{} constraints", policy->constraints.size()));
}

/// The odometry's error over the last kDriftWindow_s, as a filled curve.
void draw_born(Svg& svg, const RobotGeometry& g, const Axis& x, const Axis& y) {
  Points2d outline;
  for (const auto& e : g.errors)
    if (std::isfinite(e.born_m)) outline.emplace_back(x(e.time_s), y(e.born_m));
  if (outline.empty()) return;
  const double right = outline.back().x();
  outline.insert(outline.begin(), {outline.front().x(), y(0.0)});
  outline.emplace_back(right, y(0.0));
  svg.polyline(outline, "born", fmt::format("error of the odometry over the last {:.0f} s", kDriftWindow_s));
}

std::string timeline(const MissionRecord& record, const RobotRecord& robot, const RobotGeometry& g,
                     const Common& common) {
  constexpr double kMarksTop_px = 4.0;
  constexpr double kMarksBottom_px = 18.0;
  constexpr double kErrorsTop_px = 30.0;
  constexpr double kErrorsBottom_px = 230.0;
  constexpr double kBornTop_px = 246.0;
  constexpr double kBornBottom_px = 306.0;
  const double right = kWide_px - kDriftRight_px;
  const bool born = !common.born_m.empty;
  const double bottom = born ? kBornBottom_px : kErrorsBottom_px;
  const Axis x = Axis::linear(common.time_s, kDriftLeft_px, right, 14, false);
  const Axis y = common.logarithmic ? Axis::logarithmic(common.error_m, kErrorsBottom_px, kErrorsTop_px)
                                    : Axis::linear(common.error_m, kErrorsBottom_px, kErrorsTop_px, 5, true);
  Svg svg(kWide_px, bottom + 40.0, fmt::format("Error of {} over mission time", robot.name));
  draw_bands(svg, record, robot, x, kMarksTop_px, bottom);
  svg.text({kDriftLeft_px - 8.0, kMarksBottom_px - 3.0}, "constraints", "tick", "end");
  draw_constraints(svg, record, robot, x, kMarksTop_px, kMarksBottom_px);
  draw_axes(svg, x, y, {kDriftLeft_px, kErrorsTop_px}, {right, kErrorsBottom_px}, born ? "" : kTimeAxis, true);
  svg.vertical_text({13.0, 0.5 * (kErrorsTop_px + kErrorsBottom_px)}, "error", "axis");
  if (born) {
    const Axis rate = Axis::linear(common.born_m, kBornBottom_px, kBornTop_px, 2, true);
    draw_axes(svg, x, rate, {kDriftLeft_px, kBornTop_px}, {right, kBornBottom_px}, kTimeAxis, true);
    svg.vertical_text({13.0, 0.5 * (kBornTop_px + kBornBottom_px)}, "new drift", "axis");
    draw_born(svg, g, x, rate);
  }
  draw_errors(svg, g, x, y, common.hover_points);
  const PolicyRecord* policy = find_policy(robot, record.default_policy);
  std::string figures;
  if (g.has_reference)
    figures = "RMSE onboard " + format_rmse(robot.onboard) + ", corrected " +
              (policy != nullptr ? format_rmse(policy->accuracy) : "-") + ", server " + format_rmse(robot.server) +
              "; ";
  return figure(svg.str(), robot.name,
                figures + fmt::format("{} constraints", policy != nullptr ? policy->constraints_added : 0), true);
}

Common common_axes(const MissionRecord& record, const std::vector<RobotGeometry>& geometry) {
  Common common{.hover_points = detail_per_robot(record, 300, 20, 60)};
  common.time_s.include(0.0);
  common.time_s.include(record.duration_s);
  std::vector<double> small;
  for (const auto& g : geometry)
    for (const auto& e : g.errors) {
      common.time_s.include(e.time_s);
      common.born_m.include(e.born_m);
      for (const double value : {e.onboard_m, e.corrected_m, e.server_m}) common.error_m.include(value);
      for (const double value : {e.corrected_m, e.server_m})
        if (std::isfinite(value)) small.push_back(value);
    }
  if (!common.born_m.empty) common.born_m.include(0.0);
  common.logarithmic = wants_logarithm(geometry);
  if (common.logarithmic)  // single zero crossings must not stretch the axis
    common.error_m.low = std::max(1e-4, 0.2 * spread(small)->median);
  else
    common.error_m.include(0.0);
  return common;
}

std::string legend(const MissionRecord& record, bool any_reference) {
  std::vector<LegendEntry> entries{{"onboard", "onboard"}, {"corrected", "corrected"}};
  if (any_reference) entries.push_back({"curve server", "server"});
  entries.push_back({"mark held", "ends of constraints"});
  for (auto& entry : drift_legend(record)) entries.push_back(std::move(entry));
  if (!record.server.failed_odometry.empty()) entries.push_back({"suspect", "failure suspected by the server"});
  return legend_html(entries);
}

}  // namespace

std::vector<LegendEntry> drift_legend(const MissionRecord& record) {
  std::vector<LegendEntry> out;
  for (const auto kind : {DriftOrigin::Kind::slip, DriftOrigin::Kind::degeneracy, DriftOrigin::Kind::failure}) {
    std::size_t count = 0;
    for (const RobotRecord& robot : record.robots)
      count += static_cast<std::size_t>(std::count_if(robot.drift_origins.begin(), robot.drift_origins.end(),
                                                      [&](const DriftOrigin& d) { return d.kind == kind; }));
    if (count > 0)
      out.push_back(
          {fmt::format("drift {}", drift_name(kind)),
           count == 1 ? std::string(drift_name(kind)) : fmt::format("{} ({} times)", drift_name(kind), count)});
  }
  return out;
}

std::string errors_html(const MissionRecord& record, const std::vector<RobotGeometry>& geometry) {
  const bool any_reference =
      std::any_of(geometry.begin(), geometry.end(), [](const RobotGeometry& g) { return g.has_reference; });
  const Common common = common_axes(record, geometry);
  if (common.error_m.empty ||
      std::all_of(geometry.begin(), geometry.end(), [](const RobotGeometry& g) { return g.errors.empty(); }))
    return "";
  std::string body = legend(record, any_reference) + "<div class=\"figures\">\n";
  for (std::size_t r = 0; r < geometry.size(); ++r)
    if (!geometry[r].errors.empty()) body += timeline(record, record.robots[r], geometry[r], common);
  std::string lead = fmt::format("Distance of every keyframe to the {} after one rigid alignment{}.",
                                 any_reference ? "reference" : "server's estimate",
                                 common.logarithmic ? "; logarithmic, because the curves are far apart" : "");
  if (any_reference)
    lead += fmt::format(" New drift: what the odometry went wrong by over the last {:.0f} s, whatever the alignment.",
                        kDriftWindow_s);
  if (!drift_legend(record).empty()) lead += " Bands: where drift was really born, known to the simulator only.";
  return section("Who drifted where and when", lead, body + "</div>\n");
}

}  // namespace tutti::mission
