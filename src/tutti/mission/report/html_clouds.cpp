// SPDX-License-Identifier: BSD-3-Clause
// What the robots saw beside what is there: onboard, server, survey; as pictures and figures.
#include <fmt/format.h>

#include "tutti/mission/report/colours.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"
#include "tutti/mission/report/map_pictures.hpp"

namespace tutti::mission {
namespace {

std::string panels_html(const MapPicture& picture, bool wide) {
  const Eigen::Vector2d size(picture.view.width(), picture.view.height());
  std::string out;
  for (const MapPanel& panel : picture.panels) {
    Svg svg(size.x(), size.y(), panel.name + ": " + panel.words);
    svg.image({0.0, 0.0}, size, data_uri(encode_png(panel.image)));
    picture.view.draw_scale_bar(svg, "onpicture");
    out += figure(svg.str(), panel.name, panel.words, wide);
  }
  return out;
}

std::string distance_scale() {
  std::vector<std::pair<double, std::string>> ticks;
  for (const double share : {0.0, 0.5, 1.0})
    ticks.emplace_back(share, length_label(share * kWorstShown_m) + (share < 1.0 ? "" : " or more"));
  return colour_bar_html("Colour scale of the distance to the survey", "distance to the survey", ticks,
                         [](double share) { return hex(distance_colour(share * kWorstShown_m)); });
}

std::string error_table(const MissionRecord& record) {
  HtmlTable table{
      {"map of", "put together by", "mean", "RMS", "95 %", "within 10 cm", "within 30 cm", "within 1 m"}, {}, 2};
  const auto add = [&](const std::string& who, const std::string& estimate,
                       const std::optional<evaluation::CloudDistance>& d) {
    if (!d) return;
    const auto percent = [](double share) { return fmt::format("{:.1f} %", 100.0 * share); };
    table.rows.push_back({escape_xml(who), estimate, format_metres(d->mean_m), format_metres(d->rms_m),
                          format_metres(d->p95_m), percent(d->within_10cm), percent(d->within_30cm),
                          percent(d->within_1m)});
  };
  for (const RobotRecord& robot : record.robots) {
    add(robot.name, "onboard odometry", robot.map_error.onboard);
    add(robot.name, "corrected, policy " + escape_xml(record.default_policy), robot.map_error.corrected);
  }
  add(format_mapped_robots(record), "<b>server</b>", record.server.map_error);
  return table.rows.empty() ? "" : html(table);
}

}  // namespace

std::string clouds_html(const MissionRecord& record) {
  const MapPicture top = map_from_above(record);
  if (top.panels.empty()) return "";
  const MapPicture section_picture = map_section(record);
  const bool surveyed = record.server.map_error.has_value();
  std::string body =
      "<div class=\"figures\">\n" + panels_html(top, false) + panels_html(section_picture, true) + "</div>\n";
  if (surveyed) body = distance_scale() + body + "<br>\n" + error_table(record);
  std::string lead = fmt::format(
      "From above, then a vertical slice {:.0f} m thick across their trajectories. Every picture shows the same "
      "place "
      "at the same scale.",
      kSliceThickness_m);
  if (surveyed)
    lead += fmt::format(" The joint map of {} is {} off the survey on average, and holds {:.0f} % of it.",
                        format_mapped_robots(record), format_metres(record.server.map_error->mean_m),
                        100.0 * record.server.survey_covered.value_or(0.0));
  return section(surveyed ? "The map beside the survey" : "The map: odometry alone, and joint", lead, body);
}

}  // namespace tutti::mission
