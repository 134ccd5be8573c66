// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>

#include "tutti/mission/report/colours.hpp"
#include "tutti/mission/report/html_parts.hpp"
#include "tutti/mission/report/report.hpp"
#include "tutti/mission/report/style.hpp"

namespace tutti::mission {
namespace {

/// Every robot's colour, light and dark, and what is drawn in it.
std::string robot_colours() {
  std::string light;
  std::string dark;
  std::string classes;
  for (std::size_t r = 0; r < kRobotColours; ++r) {
    light += fmt::format(" --r{}: {};", r, hex(robot_rgb(r)));
    dark += fmt::format(" --r{}: {};", r, hex(robot_rgb_on_dark(r)));
    classes += fmt::format(
        ".r{0} {{ stroke: var(--r{0}); }} .end.r{0} {{ fill: var(--r{0}); }} .swatch.r{0} {{ background: var(--r{0}); "
        "}}\n",
        r);
  }
  return fmt::format("\n:root {{{} }}\n@media (prefers-color-scheme: dark) {{ :root {{{} }} }}\n{}", light, dark,
                     classes);
}

std::string notes_html(const MissionRecord& record) {
  if (record.notes.empty()) return "";
  std::string list = "<ul class=\"notes\">\n";
  for (const auto& note : record.notes) list += "<li>" + escape_xml(note) + "</li>\n";
  return section("What to keep in mind", "", list + "</ul>\n");
}

}  // namespace

std::size_t detail_per_robot(const MissionRecord& record, std::size_t total, std::size_t least, std::size_t most) {
  return std::clamp(total / std::max<std::size_t>(record.robots.size(), 1), least, most);
}

std::string robot_class(const MissionRecord& record, RobotId robot) {
  const auto found =
      std::find_if(record.robots.begin(), record.robots.end(), [&](const RobotRecord& r) { return r.id == robot; });
  return fmt::format("r{}", static_cast<std::size_t>(found - record.robots.begin()) % kRobotColours);
}

std::string robot_name(const MissionRecord& record, RobotId robot) {
  for (const auto& candidate : record.robots)
    if (candidate.id == robot) return candidate.name;
  return fmt::format("robot {}", robot.value);
}

std::string robot_cell(const MissionRecord& record, const RobotRecord& robot) {
  return fmt::format("<span class=\"swatch {}\"></span>{}", robot_class(record, robot.id), escape_xml(robot.name));
}

std::string section(std::string_view title, std::string_view lead, const std::string& body) {
  return fmt::format("<section>\n<h2>{}</h2>\n<p class=\"lead\">{}</p>\n{}</section>\n", escape_xml(title),
                     escape_xml(lead), body);
}

std::string figure(const std::string& svg, std::string_view name, std::string_view words, bool wide) {
  const std::string caption = name.empty() && words.empty() ? std::string()
                                                            : fmt::format("<figcaption><b>{}</b>{}</figcaption>\n",
                                                                          escape_xml(name), escape_xml(words));
  return fmt::format("<figure{}>\n{}{}</figure>\n", wide ? " class=\"wide\"" : "", caption, svg);
}

std::string page(std::string_view title, const std::string& body) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
      escape_xml(title), robot_colours() + std::string(kStyle), body);
}

std::string report_html(const MissionRecord& record) {
  std::vector<RobotGeometry> geometry;
  for (const auto& robot : record.robots) geometry.push_back(robot_geometry(record, robot));
  std::string body = headline_html(record);
  body += joint_map_html(record);
  body += clouds_html(record);
  body += errors_html(record, geometry);
  body += explanation_html(record);
  body += robot_maps_html(record, geometry);
  body += policies_html(record);
  body += proxy_graph_html(record);
  body += closures_html(record);
  body += transforms_html(record);
  body += radio_html(record);
  body += timing_html(record);
  body += notes_html(record);
  if (!record.effective_config_yaml.empty())
    body += "<details><summary>Effective configuration</summary>\n<pre>" + escape_xml(record.effective_config_yaml) +
            "</pre></details>\n";
  body += fmt::format("<footer>Made by Tutti {}. Every figure is defined in docs/report.md.</footer>\n",
                      escape_xml(record.version));
  return page(record.mission + " - Tutti", body);
}

}  // namespace tutti::mission
