// SPDX-License-Identifier: BSD-3-Clause
// Where a robot's odometry and the server's map part: at which scale, since when, by how much.
#include <fmt/format.h>

#include <algorithm>

#include "tutti/geometry/so3.hpp"
#include "tutti/mission/report/explanation.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"

namespace tutti::mission {
namespace {

std::string truth_cell(const consistency::SuspectedOrigin& origin, const RobotRecord& robot) {
  const auto truth = overlapping(origin, robot.drift_origins);
  if (!truth) return robot.drift_origins.empty() ? "" : "none";
  return fmt::format("{}, {}: {}", drift_name(truth->kind),
                     format_between(mission_clock(robot), truth->from, truth->until),
                     format_motion_error(truth->translation_m, truth->rotation_rad));
}

/// Every suspected origin of the last update, with the true one under it where the truth is known.
std::string origins_table(const RobotRecord& robot) {
  const consistency::Explanation& e = *robot.explanation;
  if (e.origins.empty()) return "";
  const bool truth = !robot.drift_origins.empty();
  HtmlTable table{
      {"suspected", "when", "where", "distance", "translation", "rotation", "scale", "over threshold"}, {}, 3};
  if (truth) table.head.push_back("really");
  for (const auto& origin : e.origins) {
    std::vector<std::string> row{origin.alert ? "<b>localisation failure</b>" : "drift",
                                 format_between(mission_clock(robot), origin.from, origin.until),
                                 format_place(origin.place_m),
                                 format_distance(origin.length_m),
                                 format_metres(origin.translation_m),
                                 fmt::format("{:.2f}°", origin.rotation_rad / kRadPerDeg),
                                 format_scale(e, origin.scale),
                                 format_significance(origin.significance)};
    if (truth) row.push_back(truth_cell(origin, robot));
    table.rows.push_back(std::move(row));
  }
  return html(table);
}

std::string verdict(const MissionRecord& record, const RobotRecord& robot) {
  const consistency::Explanation& e = *robot.explanation;
  const PolicyRecord* policy = find_policy(robot, record.default_policy);
  const std::size_t held = policy != nullptr ? policy->constraints_added : 0;
  std::string text = format_comparison(record, robot);
  text += fmt::format("; {} after one rigid alignment", format_metres(e.aligned_rmse_m));
  if (e.expected_rmse_m > 0.0)
    text += fmt::format(", the server expects {} of itself", format_metres(e.expected_rmse_m));
  return text + (held == 0 ? std::string("; nothing was added") : fmt::format("; {} constraints are held", held));
}

}  // namespace

std::string explanation_html(const MissionRecord& record) {
  std::string body;
  std::vector<consistency::SuspectedOrigin> origins;
  Range time_s;
  time_s.include(0.0);
  time_s.include(record.duration_s);
  std::string figures;
  for (const RobotRecord& robot : record.robots) {
    if (!robot.explanation || robot.explanation->stamps.empty()) continue;
    origins.insert(origins.end(), robot.explanation->origins.begin(), robot.explanation->origins.end());
    const ExplanationPicture picture{
        .explanation = &*robot.explanation,
        .label = fmt::format("Disagreement of {}'s odometry with the map: time and scale", robot.name),
        .clock = mission_clock(robot),
        .time_s = time_s,
        .time_axis = "mission time [s]",
        .truth = robot.drift_origins,
        .hover_columns = detail_per_robot(record, 180, 20, 60)};
    figures += "<div class=\"figures\">\n" +
               figure(explanation_svg(picture, kWide_px), robot.name, verdict(record, robot), true) + "</div>\n" +
               origins_table(robot);
  }
  if (figures.empty()) return "";
  std::vector<LegendEntry> legend = origin_legend(origins);
  for (auto& entry : drift_legend(record)) {
    entry.label = "really: " + entry.label;
    legend.push_back(std::move(entry));
  }
  body = significance_scale_html() + legend_html(legend) + figures;
  return section(
      "Where odometry and map part",
      "Raw odometry against the last broadcast, segment by segment and scale by scale, in units of what the "
      "server is unsure of: above 1 it is not chance. White frames: where the map says the drift was born. Missed: two "
      "places that closures tie together, and odometry does not.",
      body);
}

std::string alerts_html(const MissionRecord& record) {
  std::string list;
  for (const RobotRecord& robot : record.robots)
    for (const consistency::Alert& alert : robot.alerts)
      list += fmt::format("<li{}><b>Localisation failure {}:</b> {}, {}, noticed by the robot at {}{}</li>\n",
                          alert.withdrawn_s ? " class=\"withdrawn\"" : "",
                          alert.withdrawn_s ? "no longer suspected" : "suspected", escape_xml(robot.name),
                          format_origin(alert.origin, mission_clock(robot), robot.explanation),
                          format_moment(alert.known_since_s),
                          alert.withdrawn_s ? ", withdrawn at " + format_moment(*alert.withdrawn_s) : std::string());
  for (const FailedOdometryRecord& failed : record.server.failed_odometry)
    for (const RobotRecord& robot : record.robots)
      if (robot.id == failed.robot)
        list += fmt::format("<li><b>Localisation failure suspected by the server:</b> {}, {}: {}</li>\n",
                            escape_xml(robot.name), format_between(mission_clock(robot), failed.from, failed.until),
                            format_motion_error(failed.error_m, failed.error_rad));
  return list.empty() ? "" : "<ul class=\"alerts\">\n" + list + "</ul>\n";
}

}  // namespace tutti::mission
