// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/mission/report/plot.hpp"

/// The sections of the page: each is a function of the record that returns HTML, empty when there is nothing to show.
namespace tutti::mission {

/// How many points each robot's pictures may have: the robots share `total`, but get at least `least` and at most
/// `most`.
std::size_t detail_per_robot(const MissionRecord& record, std::size_t total, std::size_t least, std::size_t most);

/// CSS class of a robot's colour: "r0", "r1", ... in the order of the record, repeating after 8.
std::string robot_class(const MissionRecord& record, RobotId robot);
std::string robot_name(const MissionRecord& record, RobotId robot);
/// The robot's name beside a square of its colour; HTML.
std::string robot_cell(const MissionRecord& record, const RobotRecord& robot);

/// A page with `body` (HTML) in it; `title` is text.
std::string page(std::string_view title, const std::string& body);
/// A titled section. `lead` is one or two plain sentences (text, escaped here), `body` is HTML.
std::string section(std::string_view title, std::string_view lead, const std::string& body);
/// A picture with its name and a few words (text, may be empty); a `wide` one takes the whole row.
std::string figure(const std::string& svg, std::string_view name, std::string_view words, bool wide);
/// Legend of the kinds of drift in the record; CSS classes are "drift" and the kind's name.
std::vector<LegendEntry> drift_legend(const MissionRecord& record);

/// Cells are HTML. The first `left` columns are left-aligned, the others right-aligned.
struct HtmlTable {
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
  std::size_t left = 1;
};
std::string html(const HtmlTable& table);

std::string headline_html(const MissionRecord& record);
/// Suspected failures of localisation, found by the robots and by the server; part of the headline.
std::string alerts_html(const MissionRecord& record);
std::string explanation_html(const MissionRecord& record);
std::string joint_map_html(const MissionRecord& record);
std::string robot_maps_html(const MissionRecord& record, const std::vector<RobotGeometry>& geometry);
std::string proxy_graph_html(const MissionRecord& record);
/// The map's clouds beside the survey.
std::string clouds_html(const MissionRecord& record);
std::string errors_html(const MissionRecord& record, const std::vector<RobotGeometry>& geometry);
std::string policies_html(const MissionRecord& record);
std::string closures_html(const MissionRecord& record);
std::string radio_html(const MissionRecord& record);
std::string transforms_html(const MissionRecord& record);
std::string timing_html(const MissionRecord& record);

}  // namespace tutti::mission
