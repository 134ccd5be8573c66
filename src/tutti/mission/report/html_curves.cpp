// SPDX-License-Identifier: BSD-3-Clause
// What changes over the mission: disagreement per scale over time.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"
#include "tutti/mission/report/plot.hpp"

namespace tutti::mission {
namespace {

constexpr double kWidth_px = 560.0;
constexpr double kLeft_px = 66.0;
constexpr double kRight_px = 14.0;

/// One column of the heat map: consecutive updates taken together when there are too many to draw.
struct Column {
  double start_s = 0.0;
  double end_s = 0.0;
  std::uint64_t revision = 0;   ///< Of the last one.
  std::size_t constraints = 0;  ///< After the last one.
  Eigen::VectorXd mean;         ///< Largest of them, per scale.
  Eigen::VectorXd max;
};

std::vector<Column> columns(const std::vector<UpdateRecord>& updates, double end_s, std::size_t max_columns) {
  std::vector<Column> out;
  const std::size_t step = (updates.size() + max_columns - 1) / max_columns;
  for (std::size_t first = 0; first < updates.size(); first += step) {
    const std::size_t last = std::min(first + step, updates.size());
    const UpdateRecord& newest = updates[last - 1];
    Column column{updates[first].time_s,
                  last < updates.size() ? updates[last].time_s : std::max(end_s, newest.time_s),
                  newest.revision,
                  newest.constraints_total,
                  newest.mean_disagreement_m,
                  newest.max_disagreement_m};
    for (std::size_t i = first; i + 1 < last; ++i) {
      if (updates[i].mean_disagreement_m.size() == column.mean.size())
        column.mean = column.mean.cwiseMax(updates[i].mean_disagreement_m);
      if (updates[i].max_disagreement_m.size() == column.max.size())
        column.max = column.max.cwiseMax(updates[i].max_disagreement_m);
    }
    out.push_back(std::move(column));
  }
  return out;
}

/// The paper's disagreement was computed at some update.
bool is_measured(const MissionRecord& record) {
  return std::ranges::any_of(record.robots, [](const RobotRecord& robot) {
    return std::ranges::any_of(robot.updates, [](const UpdateRecord& u) { return u.mean_disagreement_m.size() > 0; });
  });
}

/// Logarithmic colour scale common to all robots: from 0.1 mm (or the smallest) to the largest mean disagreement.
struct HeatScale {
  double low = -4.0;
  double high = 0.0;
  explicit HeatScale(const MissionRecord& record) {
    Range range;
    for (const auto& robot : record.robots)
      for (const auto& update : robot.updates)
        for (const double value : update.mean_disagreement_m)
          if (value > 0.0) range.include(std::log10(value));
    if (range.empty) return;
    high = std::max(range.high, -3.0);
    low = std::clamp(range.low, -4.0, high - 1.0);
  }
  [[nodiscard]] std::string colour(double value) const {
    return heat_colour(value > 0.0 ? (std::log10(value) - low) / (high - low) : 0.0);
  }
};

std::string colour_bar(const HeatScale& scale) {
  constexpr double kBar_px = 240.0;
  constexpr double kBarLeft_px = 24.0;
  constexpr int kSteps = 60;
  Svg svg(kWidth_px, 38.0, "Colour scale of the disagreement");
  for (int i = 0; i < kSteps; ++i)
    svg.rect({kBarLeft_px + kBar_px * i / kSteps, 6.0}, {kBar_px / kSteps + 0.6, 12.0}, "cell", {},
             heat_colour((i + 0.5) / kSteps));
  for (double decade = std::ceil(scale.low - 1e-9); decade <= scale.high + 1e-9; ++decade)
    svg.text({kBarLeft_px + kBar_px * (decade - scale.low) / (scale.high - scale.low), 32.0},
             length_label(std::pow(10.0, decade)), "tick", "middle");
  svg.text({kBarLeft_px + kBar_px + 28.0, 16.0}, "mean disagreement over the nodes", "tick");
  return svg.str();
}

std::string disagreement_figure(const MissionRecord& record, const RobotRecord& robot, const HeatScale& scale) {
  constexpr double kRow_px = 22.0;
  constexpr double kStrip_px = 70.0;
  constexpr double kTop_px = 6.0;
  const auto cells = columns(robot.updates, record.duration_s, detail_per_robot(record, 360, 24, 120));
  Eigen::Index scales = 0;
  Range time;
  time.include(0.0);
  time.include(record.duration_s);
  Range held;
  held.include(0.0);
  for (const auto& column : cells) {
    scales = std::max(scales, column.mean.size());
    time.include(column.end_s);
    held.include(static_cast<double>(column.constraints));
  }
  const double map_bottom = kTop_px + kRow_px * static_cast<double>(scales);
  const double strip_top = map_bottom + 14.0;
  const double bottom = strip_top + kStrip_px;
  const Axis x = Axis::linear(time, kLeft_px, kWidth_px - kRight_px, 8, false);
  const Axis y = Axis::linear(held, bottom, strip_top, 3, true);
  Svg svg(kWidth_px, bottom + 40.0,
          scales > 0 ? fmt::format("Disagreement of {} with the server per scale over time", robot.name)
                     : fmt::format("Constraints of {} over time", robot.name));
  for (Eigen::Index s = 0; s < scales; ++s)
    svg.text({kLeft_px - 8.0, kTop_px + kRow_px * (static_cast<double>(s) + 0.5) + 4.0},
             s == 0            ? "large 0"
             : s + 1 == scales ? fmt::format("small {}", s)
                               : std::to_string(s),
             "tick", "end");
  for (const auto& column : cells)
    for (Eigen::Index s = 0; s < column.mean.size(); ++s)
      svg.rect({x(column.start_s), kTop_px + kRow_px * static_cast<double>(s)},
               {std::max(1.0, x(column.end_s) - x(column.start_s)) + 0.3, kRow_px - 1.0}, "cell",
               fmt::format("{}, broadcast {}, scale {}: mean {}, largest {}", format_mission_time(column.start_s),
                           column.revision, s, format_metres(column.mean[s]),
                           s < column.max.size() ? format_metres(column.max[s]) : "-"),
               scale.colour(column.mean[s]));
  draw_axes(svg, x, y, {kLeft_px, strip_top}, {kWidth_px - kRight_px, bottom}, "mission time [s]", false);
  Points2d steps;
  for (const auto& column : cells) {
    steps.emplace_back(x(column.start_s), steps.empty() ? y(0.0) : steps.back().y());
    steps.emplace_back(x(column.start_s), y(static_cast<double>(column.constraints)));
    steps.emplace_back(x(column.end_s), y(static_cast<double>(column.constraints)));
  }
  svg.polyline(steps, "held", "constraints held");
  svg.vertical_text({13.0, 0.5 * (strip_top + bottom)}, "constraints", "axis");
  return figure(svg.str(), robot.name,
                fmt::format("{} updates, {} constraints at the end", robot.updates.size(),
                            robot.updates.back().constraints_total),
                false);
}

}  // namespace

std::string disagreement_html(const MissionRecord& record) {
  if (std::all_of(record.robots.begin(), record.robots.end(), [](const RobotRecord& r) { return r.updates.empty(); }))
    return "";
  const HeatScale scale(record);
  std::string body = "<div class=\"figures\">\n";
  for (const auto& robot : record.robots)
    if (!robot.updates.empty()) body += disagreement_figure(record, robot, scale);
  body += "</div>\n";
  if (!is_measured(record))
    return section("What the robots hold",
                   fmt::format("Constraints of every robot after each broadcast, by policy {}. That policy does not "
                               "look at the paper's disagreement of the graph signals; to see it here over time, set "
                               "agent.always_compare.",
                               record.default_policy),
                   body);
  return section(
      "Where and when the maps disagree",
      fmt::format("At every broadcast each robot compares its map with the server's, scale by scale, before it "
                  "corrects itself with policy {}. Below: the constraints it then holds.",
                  record.default_policy),
      "<div class=\"colourbar\">" + colour_bar(scale) + "</div>\n" + body);
}

}  // namespace tutti::mission
