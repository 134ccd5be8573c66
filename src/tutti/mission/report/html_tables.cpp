// SPDX-License-Identifier: BSD-3-Clause
// The figures as tables.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/html_parts.hpp"

namespace tutti::mission {
namespace {

std::string metres(std::optional<double> value) { return format_metres(value); }

/// A figure with a bar as long as its share of `largest`.
std::string with_bar(std::optional<double> value, double largest, std::string_view css_class) {
  if (!value || !std::isfinite(*value) || !(largest > 0.0)) return metres(value);
  return fmt::format("<span class=\"track\"><span class=\"bar {}\" style=\"width:{:.1f}%\"></span></span>{}", css_class,
                     100.0 * std::min(1.0, *value / largest), metres(value));
}

/// With a bar as long as its share of `largest`, unless the error is partial.
std::string error_cell(std::optional<double> error_m, std::optional<double> scored_share, double largest,
                       std::string_view css_class) {
  return is_partial(scored_share) ? format_error(error_m, scored_share) : with_bar(error_m, largest, css_class);
}

/// Rows of one robot: onboard, every policy, server. The bar shows RMSE, or agreement without a reference.
void add_policy_rows(const MissionRecord& record, const RobotRecord& robot, std::string& body) {
  const bool referenced = robot.onboard.rmse_m.has_value();
  double largest = referenced ? *robot.onboard.rmse_m : 0.0;
  if (!referenced)
    for (const auto& policy : robot.policies) largest = std::max(largest, policy.agreement_rmse_m.value_or(0.0));
  const auto row = [&](std::string_view css_class, const std::vector<std::string>& cells) {
    body += fmt::format("<tr class=\"{}\">", css_class);
    for (std::size_t c = 0; c < cells.size(); ++c)
      body += fmt::format("<td{}>{}</td>", c == 0 ? " class=\"left\"" : "", cells[c]);
    body += "</tr>\n";
  };
  body +=
      fmt::format("<tr class=\"group\"><td class=\"left\" colspan=\"11\">{}</td></tr>\n", robot_cell(record, robot));
  // RMSE with a bar, largest error, RPE twice, and the share that they were scored on.
  const auto errors = [&](std::string name, const Accuracy& accuracy, std::optional<double> share,
                          std::string_view bar) {
    std::vector<std::string> cells{std::move(name), error_cell(accuracy.rmse_m, share, largest, bar)};
    cells.insert(cells.end(), {format_error(accuracy.max_error_m, share), metres(accuracy.rpe_m),
                               metres(accuracy.rpe_10m_m), format_scored(share)});
    return cells;
  };
  const auto without_policy = [&](std::vector<std::string> cells) {
    cells.insert(cells.end(), {"", "", "", "", ""});
    row("", cells);
  };
  without_policy(errors("onboard (raw odometry)", robot.onboard, robot.onboard.scored_share, "onboard"));
  for (const auto& policy : robot.policies) {
    const bool chosen = policy.name == record.default_policy;
    const std::string_view bar = chosen ? "" : "other";
    const PolicyTiming* timing = find_timing(record, robot.name, policy.name);
    auto cells = errors(escape_xml(policy.name), policy.accuracy, policy.accuracy.scored_share, bar);
    cells.insert(cells.end(), {policy.kink ? metres(policy.kink->translation_m) : "-",
                               referenced ? format_error(policy.agreement_rmse_m, robot.mapped_share)
                                          : error_cell(policy.agreement_rmse_m, robot.mapped_share, largest, bar),
                               std::to_string(policy.constraints_added),
                               format_share(policy.constraints_added, robot.odometry_factors),
                               timing != nullptr ? format_spread(timing->update_ms) : "-"});
    row(chosen ? "chosen" : "", cells);
  }
  without_policy(errors("server", robot.server, server_share(robot), "server"));
}

/// What the mission took of the server, as if in real time; empty when not measured.
std::string server_load_html(const ServerLoadRecord& load) {
  if (!(load.mission_s > 0.0)) return "";
  HtmlTable table{{"the server in real time", ""}, {}, 1};
  const auto share = [&](double cpu_s) { return fmt::format("{:.2f} %", 100.0 * cpu_s / load.mission_s); };
  table.rows.push_back({"of one core: receiving, optimising, proxy graphs", share(load.map_cpu_s)});
  table.rows.push_back({"of one core: verifying closures", share(load.verification_cpu_s)});
  if (load.refinement_cpu_s > 0.0)
    table.rows.push_back({"of one core: bundle adjustment", share(load.refinement_cpu_s)});
  if (const double busy_s = load.map_cpu_s + load.verification_cpu_s + load.refinement_cpu_s; busy_s > 0.0)
    table.rows.push_back({"one core would keep up with", fmt::format("{:.0f} x", load.mission_s / busy_s)});
  if (const auto latency = spread(load.update_latency_ms))
    table.rows.push_back(
        {"submap in to proxy graph out, median / largest",
         fmt::format("{} / {}", format_duration_ms(latency->median), format_duration_ms(latency->max))});
  table.rows.push_back({"memory at most, simulator and robots included", format_bytes(1e6 * load.peak_memory_mb)});
  return "<br>\n" + html(table);
}

}  // namespace

std::string html(const HtmlTable& table) {
  const auto row = [&](const std::vector<std::string>& cells, std::string_view tag) {
    std::string out = "<tr>";
    for (std::size_t c = 0; c < cells.size(); ++c)
      out += fmt::format("<{0}{1}>{2}</{0}>", tag, c < table.left ? " class=\"left\"" : "", cells[c]);
    return out + "</tr>\n";
  };
  std::string out = "<div class=\"scroll\"><table>\n<thead>" + row(table.head, "th") + "</thead>\n<tbody>\n";
  for (const auto& cells : table.rows) out += row(cells, "td");
  return out + "</tbody></table></div>\n";
}

std::string policies_html(const MissionRecord& record) {
  if (record.robots.empty()) return "";
  std::string body =
      "<div class=\"scroll\"><table>\n<thead><tr><th class=\"left\">estimate or policy</th><th>RMSE</th><th>largest "
      "error</th><th>RPE</th><th>RPE, 10 m</th><th>scored</th><th>discontinuity</th><th>RMSE to "
      "server</th><th>constraints</th><th>of "
      "odometry</th><th>update, ms</th>"
      "</tr></thead>\n<tbody>\n";
  for (const auto& robot : record.robots) add_policy_rows(record, robot, body);
  const bool several = compares_policies(record);
  return section(
      several ? "Policies side by side" : "Each robot in figures",
      fmt::format(
          "{} RMSE and largest error at keyframes after one rigid alignment, without scale{}. Scored: the share "
          "of the trajectory that these figures were scored on; below 95 % they are partial, in brackets. "
          "Discontinuity: the "
          "most that correcting changed any motion over 1 s. Update: median / largest.",
          several ? fmt::format("Every policy answers the very same broadcasts; {} is the one the robot follows.",
                                record.default_policy)
                  : fmt::format("Corrected by the policy {}.", record.default_policy),
          record.rpe_interval.empty() ? "" : "; RPE over " + record.rpe_interval),
      body + "</tbody></table></div>\n");
}

std::string closures_html(const MissionRecord& record) {
  const ServerRecord& server = record.server;
  const ClosureCounts counts = count_closures(server);
  if (counts.accepted() + counts.rejected() == 0) return "";
  HtmlTable table{{"loop closures", "within a robot", "between robots", "together"}, {}, 1};
  const auto add = [&](const std::string& name, std::size_t intra, std::size_t inter) {
    table.rows.push_back({name, std::to_string(intra), std::to_string(inter), std::to_string(intra + inter)});
  };
  add("<b>accepted</b>", counts.accepted_intra, counts.accepted_inter);
  for (const auto& rejection : server.rejections)
    add(fmt::format("refused: {}", kind_of(rejection.reason).words), rejection.intra, rejection.inter);
  std::string lead = "What the server took into the map, and why it refused the rest.";
  if (const auto& check = server.closure_check)
    lead += fmt::format(
        " Against the reference, {} of {} accepted closures are wrong by more than {} m or {} degrees; the largest "
        "errors are {} and {:.2f} degrees.",
        check->wrong, check->checked, check->wrong_m, check->wrong_deg, format_metres(check->max_error_m),
        check->max_error_deg);
  if (const std::string surer = format_surer_turns(record.robots); !surer.empty())
    lead += fmt::format(" {}", escape_xml(surer));
  if (server.refinement) lead += fmt::format(" {}", format_refinement(*server.refinement));
  return section("Loop closures", lead, html(table));
}

std::string radio_html(const MissionRecord& record) {
  if (record.robots.empty()) return "";
  HtmlTable robots{{"robot", "up", "down", "keyframes", "submaps", "proxy nodes"}, {}, 1};
  HtmlTable kinds{{"from", "to", "kind", "messages", "largest", "handed over", "on the air", "mean rate"}, {}, 3};
  const auto bytes = [](std::uint64_t count) { return format_bytes(static_cast<double>(count)); };
  for (const auto& robot : record.robots) {
    robots.rows.push_back({robot_cell(record, robot), format_rate(robot.bytes_up, robot.duration_s),
                           format_rate(robot.bytes_down, robot.duration_s), std::to_string(robot.keyframes),
                           std::to_string(robot.submaps), std::to_string(robot.proxy_nodes)});
    for (const TrafficRecord& row : robot.traffic)
      kinds.rows.push_back({escape_xml(row.from), escape_xml(row.to), escape_xml(row.kind),
                            std::to_string(row.messages), bytes(row.largest_message), bytes(row.bytes),
                            bytes(row.transmitted_bytes), format_bytes(row.bytes_per_s) + "/s"});
  }
  return section("What goes over the radio",
                 "Bytes of the encoded and compressed messages: submaps go up, proxy graphs come down. Rates are means "
                 "over the robot's own run. On the air: without what was never sent, repetitions included.",
                 html(robots) + (kinds.rows.empty() ? "" : "<br>\n" + html(kinds)));
}

std::string transforms_html(const MissionRecord& record) {
  if (record.transforms.empty()) return "";
  HtmlTable table{{"odometry frame of", "seen from", "x", "y", "z", "turned by", "off the reference", ""}, {}, 2};
  for (const auto& transform : record.transforms) {
    const Eigen::Vector3d& t = transform.T_from_to.translation;
    table.rows.push_back({escape_xml(transform.to), escape_xml(transform.from), metres(t.x()), metres(t.y()),
                          metres(t.z()), fmt::format("{:.2f}°", rotation_angle(transform.T_from_to) * 180.0 / M_PI),
                          metres(transform.error_m),
                          transform.error_deg ? fmt::format("{:.3f}°", *transform.error_deg) : "-"});
  }
  return section("How the robots' frames lie",
                 "Nobody told the server where the robots started. The difference to the reference is measured at the "
                 "centroid of the second robot's trajectory.",
                 html(table));
}

std::string timing_html(const MissionRecord& record) {
  const TimingRecord& timing = record.timing;
  HtmlTable table{{"work", "who", "times", "median", "largest"}, {}, 2};
  const auto add = [&](const std::string& work, const std::string& who, const std::vector<double>& samples) {
    if (const auto s = spread(samples))
      table.rows.push_back(
          {work, who, std::to_string(s->count), format_duration_ms(s->median), format_duration_ms(s->max)});
  };
  for (const auto& policy : timing.policies) {
    if (policy.policy != record.default_policy) continue;
    const std::string name = escape_xml(policy.robot);
    add("comparison with the map", name, policy.comparison_ms);
    add("onboard optimisation", name, policy.optimisation_ms);
    add("whole update", name, policy.update_ms);
  }
  add("verification of one candidate closure", "server", timing.server_verification_ms);
  add("joint optimisation", "server", timing.server_optimisation_ms);
  std::string body = table.rows.empty() ? "" : html(table);
  if (!timing.load.empty()) {
    HtmlTable load{{"who", "share of one core", "worst latency"}, {}, 1};
    for (const auto& entry : timing.load)
      load.rows.push_back({escape_xml(entry.name), fmt::format("{:.1f} %", 100.0 * entry.cpu_share),
                           format_duration_ms(entry.worst_latency_ms)});
    body += "<br>\n" + html(load);
  }
  body += server_load_html(timing.server_load);
  if (body.empty()) return "";
  std::string lead = fmt::format("Wall-clock time, {} in all", format_duration_ms(1000.0 * timing.wall_s));
  if (timing.rate) lead += fmt::format(", played at {} times real time", *timing.rate);
  return section("Time", lead + "." + (timing.machine.empty() ? "" : " Machine: " + timing.machine + "."), body);
}

}  // namespace tutti::mission
