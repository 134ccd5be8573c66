// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/report_html.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/mission/report_format.hpp"
#include "tutti/mission/report_html_parts.hpp"

namespace tutti::mission {
namespace {

constexpr std::size_t kRobotColours = 8;

struct Card {
  std::string what, value, detail;  ///< HTML
};

std::string cards_html(const std::vector<Card>& cards) {
  std::string out = "<div class=\"cards\">\n";
  for (const auto& card : cards)
    out += fmt::format(
        "<div class=\"card\"><p class=\"what\">{}</p><p class=\"value\">{}</p><p class=\"detail\">{}</p></div>\n",
        card.what, card.value, card.detail);
  return out + "</div>\n";
}

/// Mean of what was measured over the robots.
template <class Get>
std::optional<double> mean_over_robots(const MissionRecord& record, Get get) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const auto& robot : record.robots)
    if (const std::optional<double> value = get(robot); value && std::isfinite(*value)) {
      sum += *value;
      ++count;
    }
  return count == 0 ? std::nullopt : std::optional<double>(sum / static_cast<double>(count));
}

Card error_card(const MissionRecord& record) {
  const auto onboard = mean_over_robots(record, [](const RobotRecord& r) { return r.onboard.rmse_m; });
  const auto corrected = mean_over_robots(record, [&](const RobotRecord& r) {
    const PolicyRecord* policy = find_policy(r, record.default_policy);
    return policy != nullptr ? policy->accuracy.rmse_m : std::nullopt;
  });
  const auto agreement = mean_over_robots(record, [&](const RobotRecord& r) {
    const PolicyRecord* policy = find_policy(r, record.default_policy);
    return policy != nullptr ? policy->agreement_rmse_m : std::nullopt;
  });
  const std::string to_server = "corrected robots differ from the server by " + format_metres(agreement);
  if (onboard && corrected)
    return {"Error of the robots, RMSE: onboard → corrected",
            fmt::format("<small>{} →</small> {}", format_metres(onboard), format_metres(corrected)),
            "mean; " + to_server};
  return {"Corrected robots against the server, RMSE", format_metres(agreement),
          "no reference: errors could not be measured"};
}

std::vector<Card> headline_cards(const MissionRecord& record) {
  std::vector<Card> cards{error_card(record)};
  if (record.server.joint.rmse_m)
    cards.push_back({"Error of the server's map, RMSE", format_metres(record.server.joint.rmse_m),
                     "all robots in one alignment; largest " + format_metres(record.server.joint.max_error_m)});
  const ClosureCounts closures = count_closures(record.server);
  cards.push_back({"Loop closures in the map", std::to_string(closures.accepted()),
                   fmt::format("{} between robots; {} refused", closures.accepted_inter, closures.rejected())});
  std::size_t constraints = 0;
  std::size_t factors = 0;
  double up = 0.0;
  double down = 0.0;
  double seconds = 0.0;
  std::vector<double> update_ms;
  for (const auto& robot : record.robots) {
    factors += robot.odometry_factors;
    up += static_cast<double>(robot.bytes_up);
    down += static_cast<double>(robot.bytes_down);
    seconds += robot.duration_s;
    if (const PolicyRecord* policy = find_policy(robot, record.default_policy))
      constraints += policy->constraints_added;
    if (const PolicyTiming* timing = find_timing(record, robot.name, record.default_policy))
      update_ms.insert(update_ms.end(), timing->update_ms.begin(), timing->update_ms.end());
  }
  cards.push_back({"Constraints the robots added", std::to_string(constraints),
                   fmt::format("{} of {} odometry factors", format_share(constraints, factors), factors)});
  if (seconds > 0.0)
    cards.push_back(
        {"Radio per robot: down ↓ and up ↑",
         fmt::format("{}/s <small>↓ {}/s ↑</small>", format_bytes(down / seconds), format_bytes(up / seconds)),
         "encoded messages, mean over the mission"});
  if (const auto update = spread(update_ms))
    cards.push_back({"A robot's answer to a broadcast", format_duration_ms(update->median),
                     fmt::format("median of {}; slowest {}", update->count, format_duration_ms(update->max))});
  return cards;
}

std::string notes_html(const MissionRecord& record) {
  if (record.notes.empty()) return "";
  std::string list = "<ul class=\"notes\">\n";
  for (const auto& note : record.notes) list += "<li>" + escape_xml(note) + "</li>\n";
  return section("What to keep in mind", "", list + "</ul>\n");
}

std::string header_html(const MissionRecord& record) {
  double distance_m = 0.0;
  for (const auto& robot : record.robots) distance_m += robot.distance_m;
  const std::size_t maps = record.server.components;
  std::string out =
      fmt::format("<p class=\"brand\">Tutti</p>\n<h1>{}</h1>\n<p class=\"description\">{}</p>\n<ul class=\"facts\">\n",
                  escape_xml(record.mission), escape_xml(record.description));
  const auto fact = [&](const std::string& text, std::string_view css_class = {}) {
    out += fmt::format("<li{}>{}</li>\n", css_class.empty() ? "" : fmt::format(" class=\"{}\"", css_class),
                       escape_xml(text));
  };
  if (!record.input.empty()) fact(record.input, "input");
  fact(fmt::format("{} robot{}, {} map{}", record.robots.size(), record.robots.size() == 1 ? "" : "s", maps,
                   maps == 1 ? "" : "s"));
  fact(fmt::format("{} in {}", format_distance(distance_m), format_mission_time(record.duration_s)));
  fact("policy " + record.default_policy);
  fact(fmt::format("seed {}", record.seed));
  return out + "</ul>\n";
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

std::string headline_html(const MissionRecord& record) {
  return header_html(record) + cards_html(headline_cards(record));
}

std::string report_html(const MissionRecord& record) {
  std::vector<RobotGeometry> geometry;
  for (const auto& robot : record.robots) geometry.push_back(robot_geometry(record, robot));
  std::string body = headline_html(record);
  body += joint_map_html(record);
  body += robot_maps_html(record, geometry);
  body += errors_html(record, geometry);
  body += policies_html(record);
  body += disagreement_html(record);
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
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{} - Tutti</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n{}</main>\n</body>\n</html>\n",
      escape_xml(record.mission), report_style(), body);
}

}  // namespace tutti::mission
