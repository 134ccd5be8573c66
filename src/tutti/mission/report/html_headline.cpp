// SPDX-License-Identifier: BSD-3-Clause
// What one reads first: the mission, what was corrected with how little, the map in figures.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"

namespace tutti::mission {
namespace {

struct Card {
  std::string what, value, detail;  ///< HTML
};

std::string cards_html(const std::vector<Card>& cards, std::string_view css_class) {
  std::string out = fmt::format("<div class=\"{}\">\n", css_class);
  for (const auto& card : cards)
    out += fmt::format(
        "<div class=\"card\"><p class=\"what\">{}</p><p class=\"value\">{}</p><p class=\"detail\">{}</p></div>\n",
        card.what, card.value, card.detail);
  return out + "</div>\n";
}

std::string from_to(std::optional<double> onboard_m, std::optional<double> corrected_m) {
  return fmt::format("<span class=\"up\">{}</span> → <span class=\"down\">{}</span>", format_metres(onboard_m),
                     format_metres(corrected_m));
}

std::optional<double> headline_rmse(const Accuracy& accuracy) {
  return for_headline(accuracy.rmse_m, accuracy.scored_share);
}

/// What is no headline, because it was scored on too little of the robot's way; empty when nothing is.
std::string partial_figures(const RobotRecord& robot, const PolicyRecord* policy) {
  std::string out;
  const auto add = [&](std::string_view what, std::optional<double> rmse_m, std::optional<double> share) {
    if (rmse_m && is_partial(share))
      out += fmt::format("<br>partial, scored on {} of its trajectory only: {} {}", format_scored(share), what,
                         format_error(rmse_m, share));
  };
  add("onboard", robot.onboard.rmse_m, robot.onboard.scored_share);
  if (policy != nullptr) add("corrected", policy->accuracy.rmse_m, policy->accuracy.scored_share);
  add("server", robot.server.rmse_m, robot.server.scored_share);
  if (policy != nullptr) add("to the server", policy->agreement_rmse_m, robot.mapped_share);
  return out;
}

/// What was corrected with how little.
Card robot_card(const MissionRecord& record, const RobotRecord& robot) {
  const PolicyRecord* policy = find_policy(robot, record.default_policy);
  const std::size_t constraints = policy != nullptr ? policy->constraints_added : 0;
  Card card;
  card.what = robot_cell(record, robot) + fmt::format(" <small>{} in {}</small>", format_distance(robot.distance_m),
                                                      format_mission_time(robot.duration_s));
  if (robot.onboard.rmse_m && policy != nullptr)
    card.value = from_to(headline_rmse(robot.onboard), headline_rmse(policy->accuracy)) +
                 fmt::format(" <small>server {}</small>", format_metres(headline_rmse(robot.server)));
  else
    card.value = robot.onboard.rmse_m ? "-" : "not measured <small>no reference</small>";
  const auto agreement = policy != nullptr ? for_headline(policy->agreement_rmse_m, robot.mapped_share) : std::nullopt;
  if (!robot.onboard.rmse_m && agreement)
    card.detail =
        fmt::format("corrected and server agree within {} RMSE, however true both are<br>", format_metres(agreement));
  card.detail +=
      fmt::format("<b>{}</b> constraints beside {} odometry factors ({}); <b>{}</b> received ({}), {} sent ({})",
                  constraints, robot.odometry_factors, format_share(constraints, robot.odometry_factors),
                  format_bytes(static_cast<double>(robot.bytes_down)), format_rate(robot.bytes_down, robot.duration_s),
                  format_bytes(static_cast<double>(robot.bytes_up)), format_rate(robot.bytes_up, robot.duration_s));
  card.detail += partial_figures(robot, policy);
  if (const auto& [onboard, corrected] = robot.map_error; onboard && corrected)
    card.detail += fmt::format("<br>its map, mean distance to the survey: <b>{} → {}</b>",
                               format_metres(onboard->mean_m), format_metres(corrected->mean_m));
  return card;
}

std::string robots_html(const MissionRecord& record) {
  std::vector<Card> cards;
  bool referenced = false;
  for (const RobotRecord& robot : record.robots) {
    cards.push_back(robot_card(record, robot));
    referenced = referenced || robot.onboard.rmse_m.has_value();
  }
  if (cards.empty()) return "";
  return fmt::format("<p class=\"lead\">{}</p>\n", referenced
                                                       ? "Error of every robot, RMSE: by its own odometry → corrected"
                                                       : "Error of every robot: not measured, because there is no "
                                                         "reference") +
         cards_html(cards, "robots");
}

std::vector<Card> map_cards(const MissionRecord& record) {
  const ServerRecord& server = record.server;
  const std::string whose = escape_xml(format_mapped_robots(record));
  std::vector<Card> cards;
  const bool partial = is_partial(server.joint.scored_share);
  const auto add = [&](const std::string& what, double figure_m, const std::string& detail) {
    const std::string figure = format_metres(figure_m);
    if (partial)
      cards.push_back({what, "-",
                       fmt::format("partial, scored on {} of all robots' trajectories only: ({}), {}",
                                   format_scored(server.joint.scored_share), figure, detail)});
    else
      cards.push_back({what, figure, detail});
  };
  if (server.joint.rmse_m)
    add("Error of the server's map, RMSE", *server.joint.rmse_m,
        whose + " in one alignment; largest " + format_metres(server.joint.max_error_m));
  if (server.map_error)
    add("Joint map off the survey, mean", server.map_error->mean_m,
        fmt::format("{}; 95 % of {} points within {}", whose, server.map_error->points,
                    format_metres(server.map_error->p95_m)));
  const ClosureCounts closures = count_closures(server);
  cards.push_back({"Loop closures in the map", std::to_string(closures.accepted()),
                   fmt::format("{} between robots; {} refused", closures.accepted_inter, closures.rejected())});
  std::vector<double> update_ms;
  for (const auto& robot : record.robots)
    if (const PolicyTiming* timing = find_timing(record, robot.name, record.default_policy))
      update_ms.insert(update_ms.end(), timing->update_ms.begin(), timing->update_ms.end());
  if (const auto update = spread(update_ms))
    cards.push_back({"A robot's answer to a broadcast", format_duration_ms(update->median),
                     fmt::format("median of {}; slowest {}", update->count, format_duration_ms(update->max))});
  return cards;
}

std::string warnings_html(const MissionRecord& record) {
  std::string list;
  for (const std::string& warning : record.warnings) list += "<li><b>Warning:</b> " + escape_xml(warning) + "</li>\n";
  return list.empty() ? "" : "<ul class=\"alerts\">\n" + list + "</ul>\n";
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

std::string headline_html(const MissionRecord& record) {
  return header_html(record) + warnings_html(record) + alerts_html(record) + robots_html(record) +
         cards_html(map_cards(record), "cards");
}

}  // namespace tutti::mission
