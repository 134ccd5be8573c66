// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tutti/mission/report/explanation.hpp"
#include "tutti/mission/report/format.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/mission/report/report.hpp"
#include "tutti/mission/report/table.hpp"
#include "tutti/mission/worst_update.hpp"

namespace tutti::mission {
namespace {

constexpr std::size_t kRobotsPerPolicyTable = 2;

std::string plural(std::size_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

std::string robots_table(const MissionRecord& record) {
  TextTable table(2);
  table.add({"robot", "estimate", "RMSE", "max", "RPE", "RPE 10 m", "scored", "to server", "constr.", "update ms"});
  for (const auto& robot : record.robots) {
    table.rule();
    const auto row = [&](const std::string& left, const std::string& estimate, const Accuracy& accuracy,
                         std::optional<double> share, std::vector<std::string> rest) {
      std::vector<std::string> cells{left,
                                     estimate,
                                     format_error(accuracy.rmse_m, share),
                                     format_error(accuracy.max_error_m, share),
                                     format_metres(accuracy.rpe_m),
                                     format_metres(accuracy.rpe_10m_m)};
      cells.push_back(format_scored(share));
      cells.insert(cells.end(), rest.begin(), rest.end());
      table.add(std::move(cells));
    };
    row(robot.name, "onboard", robot.onboard, robot.onboard.scored_share, {});
    const PolicyRecord* policy = find_policy(robot, record.default_policy);
    const PolicyTiming* timing = find_timing(record, robot.name, record.default_policy);
    const std::string size = format_distance(robot.distance_m);
    if (policy != nullptr)
      row(size, "corrected", policy->accuracy, policy->accuracy.scored_share,
          {format_error(policy->agreement_rmse_m, robot.mapped_share), std::to_string(policy->constraints_added),
           timing != nullptr ? format_spread(timing->update_ms) : "-"});
    row(policy != nullptr ? "" : size, "server", robot.server, server_share(robot), {});
  }
  return table.str();
}

/// Policies down, robots across; several tables when there are many robots.
std::string policies_table(const MissionRecord& record, std::size_t first, std::size_t last) {
  std::vector<std::string> names;
  for (std::size_t r = first; r < last; ++r)
    for (const auto& policy : record.robots[r].policies)
      if (std::find(names.begin(), names.end(), policy.name) == names.end()) names.push_back(policy.name);
  if (names.empty()) return "";

  TextTable table(1);
  std::vector<std::string> robots{""};
  std::vector<std::string> head{"policy"};
  for (std::size_t r = first; r < last; ++r) {
    robots.insert(robots.end(), {"", "", "", record.robots[r].name});
    head.insert(head.end(), {"RMSE", "to server", "constr.", "update ms"});
  }
  table.add(robots);
  table.add(head);
  table.rule();
  for (const auto& name : names) {
    std::vector<std::string> cells{name == record.default_policy ? name + " *" : name};
    for (std::size_t r = first; r < last; ++r) {
      const RobotRecord& robot = record.robots[r];
      const PolicyRecord* policy = find_policy(robot, name);
      const PolicyTiming* timing = find_timing(record, robot.name, name);
      if (policy == nullptr)
        cells.insert(cells.end(), {"-", "-", "-", "-"});
      else
        cells.insert(cells.end(), {format_error(policy->accuracy.rmse_m, policy->accuracy.scored_share),
                                   format_error(policy->agreement_rmse_m, robot.mapped_share),
                                   std::to_string(policy->constraints_added),
                                   timing != nullptr ? format_spread(timing->update_ms) : "-"});
    }
    table.add(std::move(cells));
  }
  return table.str();
}

/// Bytes per second over each robot's own time.
std::string radio_table(const MissionRecord& record) {
  TextTable table(2);
  table.add({"radio", "kind", "messages", "total", "mean rate", "largest"});
  for (const auto& robot : record.robots) {
    if (robot.traffic.empty()) continue;
    table.rule();
    for (const auto& row : robot.traffic)
      table.add({fmt::format("{} to {}", row.from, row.to), row.kind, std::to_string(row.messages),
                 format_bytes(static_cast<double>(row.bytes)), format_bytes(row.bytes_per_s) + "/s",
                 format_bytes(static_cast<double>(row.largest_message))});
  }
  return table.str();
}

std::string server_lines(const MissionRecord& record) {
  const ServerRecord& server = record.server;
  const ClosureCounts closures = count_closures(server);
  const std::string maps = format_maps(record);
  std::string text =
      fmt::format("{}{} of {}, {} ({} between robots), {} refused", plural(server.components, "map"),
                  maps.empty() ? "" : fmt::format(" ({})", maps), plural(record.robots.size(), "robot"),
                  plural(closures.accepted(), "loop closure"), closures.accepted_inter, closures.rejected());
  if (is_partial(server.joint.scored_share))
    text += fmt::format("; partial: RMSE ({}) over {} at once is scored on {} of all robots' trajectories",
                        format_metres(server.joint.rmse_m), format_mapped_robots(record),
                        format_scored(server.joint.scored_share));
  else if (server.joint.rmse_m)
    text += fmt::format(", RMSE {} over {} at once (max {}; scored on {} of the trajectory)",
                        format_metres(server.joint.rmse_m), format_mapped_robots(record),
                        format_metres(server.joint.max_error_m), format_scored(server.joint.scored_share));
  if (const auto& check = server.closure_check)
    text += fmt::format(
        ". Of {} closures checked against the reference {} wrong by more than {} m or {} deg "
        "(largest error {}, {:.2f} deg)",
        check->checked, check->wrong == 1 ? "1 is" : fmt::format("{} are", check->wrong), check->wrong_m,
        check->wrong_deg, format_metres(check->max_error_m), check->max_error_deg);
  std::string out = wrap(text + ".", "  server   ");
  if (server.refinement) out += wrap(format_refinement(*server.refinement), "  cameras  ");
  if (server.fixes) out += wrap(format_fixes(*server.fixes), "  earth    ");
  if (const std::string surer = format_surer_turns(record.robots); !surer.empty()) out += wrap(surer, "  odometry ");
  for (const auto& transform : record.transforms) {
    const Eigen::Vector3d& t = transform.T_from_to.translation;
    std::string line =
        fmt::format("{} in {}'s frame: [{:.2f} {:.2f} {:.2f}] m, turned by {:.1f} deg", transform.to, transform.from,
                    t.x(), t.y(), t.z(), rotation_angle(transform.T_from_to) * 180.0 / M_PI);
    if (transform.error_m && transform.error_deg)
      line +=
          fmt::format("; off the reference by {}, {:.2f} deg", format_metres(transform.error_m), *transform.error_deg);
    out += wrap(line + ".", "  frames   ");
  }
  for (const auto& load : record.timing.load)
    out += wrap(fmt::format("{}: {:.0f} % of one core, answers after {} at worst.", load.name, 100.0 * load.cpu_share,
                            format_duration_ms(load.worst_latency_ms)),
                "  load     ");
  return out;
}

/// How gently the correction bent odometry.
std::string correction_lines(const RobotRecord& robot, const PolicyRecord& policy) {
  if (!policy.discontinuity || policy.constraints_added == 0) return "";
  return wrap(fmt::format("{}: correcting changed no motion over 1 s by more than {} and {:.3f} deg.", robot.name,
                          format_metres(policy.discontinuity->translation_m), policy.discontinuity->rotation_deg),
              "  change   ");
}

/// Less harm than this is not worth a line, m.
constexpr double kHarm_m = 0.01;

/// When correcting did more harm than good, if it ever did.
std::string worst_lines(const RobotRecord& robot, const std::string& policy) {
  const auto worst = worst_of_policy(robot.updates, policy);
  if (!worst || worst->rmse_m - worst->onboard_rmse_m < kHarm_m) return "";
  return wrap(fmt::format("{}: corrected was worse than odometry by {} at most, at {} ({} instead of {}).", robot.name,
                          format_metres(worst->rmse_m - worst->onboard_rmse_m), format_time_s(worst->time_s),
                          format_metres(worst->rmse_m), format_metres(worst->onboard_rmse_m)),
              "  worst    ");
}

/// Where odometry and map part, what the robots warned of, and how gently they were corrected.
std::string explanation_lines(const MissionRecord& record) {
  std::string out;
  for (const RobotRecord& robot : record.robots) {
    for (const consistency::Alert& alert : robot.alerts)
      out += wrap(fmt::format("{}: localisation failure {}, {}; noticed at {}.", robot.name,
                              alert.withdrawn_s ? "no longer suspected" : "suspected",
                              format_origin(alert.origin, mission_clock(robot), robot.explanation),
                              format_time_s(alert.known_since_s)),
                  "  alert    ");
    const PolicyRecord* policy = find_policy(robot, record.default_policy);
    if (robot.explanation && !robot.explanation->stamps.empty()) {
      const consistency::Explanation& e = *robot.explanation;
      const auto drift = std::count_if(e.origins.begin(), e.origins.end(), [](const auto& o) { return !o.alert; });
      std::string text = robot.name + ": " + format_comparison(record, robot);
      if (drift > 0)
        text += fmt::format("; {} of drift that odometry's covariance allows for",
                            plural(static_cast<std::size_t>(drift), "suspected origin"));
      if (policy != nullptr && policy->constraints_added == 0) text += "; nothing was added";
      out += wrap(text + ".", "  compare  ");
    }
    if (policy != nullptr) out += correction_lines(robot, *policy);
    out += worst_lines(robot, record.default_policy);
  }
  return out;
}

}  // namespace

std::string report_text(const MissionRecord& record, const std::string& report_html_path) {
  std::string out = "\n";
  for (const auto& warning : record.warnings) out += wrap("Warning: " + warning, "");
  out +=
      wrap(record.description.empty() ? record.mission : fmt::format("{}: {}", record.mission, record.description), "");
  out += wrap(fmt::format("{}Seed {}, {} of mission time.",
                          record.input.empty() ? "" : fmt::format("Input: {}. ", record.input), record.seed,
                          format_mission_time(record.duration_s)),
              "");
  if (!record.robots.empty()) {
    const bool referenced = std::any_of(record.robots.begin(), record.robots.end(),
                                        [](const RobotRecord& robot) { return robot.onboard.rmse_m.has_value(); });
    out += "\n";
    out += robots_table(record);
    out +=
        referenced
            ? fmt::format(
                  "  RMSE, max: against the reference, after one rigid alignment per robot. RPE: over {} and 10 m.\n",
                  record.rpe_interval)
            : std::string("  No reference: no error could be measured, only how far corrected and server agree.\n");
    out += "  scored: share of the trajectory that these figures cover.";
    if (has_partial_figures(record))
      out += fmt::format(" In brackets: partial, below {:.0f} %.", 100.0 * kPartialBelow);
    out += "\n  to server: RMSE of corrected against server, no accuracy. update ms: median / max, wall clock.\n";
    out += "\n";
    if (compares_policies(record)) {
      out += "  Policies side by side, on the same broadcasts (* = corrected above)\n";
      for (std::size_t first = 0; first < record.robots.size(); first += kRobotsPerPolicyTable)
        out += policies_table(record, first, std::min(first + kRobotsPerPolicyTable, record.robots.size())) + "\n";
    }
    out += radio_table(record) + "\n";
  }
  out += explanation_lines(record);
  out += server_lines(record);
  for (const auto& note : record.notes) out += wrap(note, "  note     ");
  if (record.timing.wall_s > 0.0)
    out += wrap(fmt::format("{} for {} of mission time.", format_duration_ms(1000.0 * record.timing.wall_s),
                            format_mission_time(record.duration_s)),
                "  took     ");
  return out + "\nReport: " + report_html_path + "\n";
}

}  // namespace tutti::mission
