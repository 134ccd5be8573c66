// SPDX-License-Identifier: BSD-3-Clause
// Lists the problems that an operator should hear of without asking, from statuses and maps.
#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "tutti/program/field_json.hpp"
#include "tutti/program/page/view.hpp"
#include "tutti/server/map_components.hpp"

namespace tutti::page {
namespace {

constexpr double kNoUpdate_s = 300.0;  // a robot that is heard, and does not use the map
/// Or so long per submap: a map of 17,600 has taken 195 s of CPU, and so is updated every 13 minutes (UpdatePacer).
constexpr double kNoUpdatePerSubmap_s = 0.06;
constexpr std::uint64_t kLongBacklog = 30;  // submaps, five minutes of mapping
constexpr double kLowBattery_percent = 20.0;
constexpr std::uint64_t kManyWaitingJobs = 200;

double longest_without_update_s(const MissionStatus& status) {
  return std::max(kNoUpdate_s, kNoUpdatePerSubmap_s * static_cast<double>(status.submaps));
}

Alert robot_alert(const MissionStatus::Robot& robot, const char* kind, Severity severity, std::string what,
                  std::string todo) {
  return {.id = fmt::format("robot/{}/{}", robot.robot.value, kind),
          .severity = severity,
          .what = std::move(what),
          .where = robot.status.name,
          .todo = std::move(todo),
          .robot = robot.robot};
}

/// When the robot was last heard is known, so that is when this began.
void check_silence(const MissionStatus& status, const MissionStatus::Robot& robot, double limit_s,
                   std::vector<Alert>& out) {
  if (robot.status.finished) return;
  if (!robot.last_seen) {
    out.push_back(robot_alert(robot, "unseen", Severity::info, "not heard since the server started",
                              "Start its program, or check its network."));
    return;
  }
  const double silent_s = status.time - *robot.last_seen;
  if (silent_s < limit_s) return;
  Alert alert =
      robot_alert(robot, "silent", Severity::warning, "silent",
                  "If its program runs, it goes on mapping and joins again when the radio reaches it; else start it.");
  alert.since_s = *robot.last_seen - Timestamp{};
  out.push_back(std::move(alert));
}

void check_robot(const MissionStatus& status, const MissionStatus::Robot& robot, double silent_s,
                 std::vector<Alert>& out) {
  check_silence(status, robot, silent_s, out);
  const NodeStatus& own = robot.status;
  const bool is_heard = robot.last_seen && status.time - *robot.last_seen < silent_s;
  if (!robot.conflict.empty())
    out.push_back(robot_alert(robot, "conflict", Severity::error, robot.conflict,
                              "Two programs claim to be this robot: stop one, or give it another --name."));
  if (!own.trouble.empty())
    out.push_back(robot_alert(robot, "trouble", Severity::warning, own.trouble, "See the robot's log.txt."));
  if (own.alerts > 0)
    out.push_back(robot_alert(robot, "drift", Severity::warning,
                              own.alerts == 1 ? "its odometry left the map at one place"
                                              : fmt::format("its odometry left the map at {} places", own.alerts),
                              "Look at disagreement: the robot is corrected, its sensors may not be well."));
  if (own.backlog_submaps >= kLongBacklog)
    out.push_back(robot_alert(robot, "backlog", Severity::warning,
                              fmt::format("{} submaps are not on the server yet", own.backlog_submaps),
                              "Bring it nearer to the base, or wait: the newest come first."));
  const bool is_behind = own.heard_epoch != status.epoch || own.heard_revision < status.revision;
  if (is_heard && !own.finished && robot.submaps > 0 && status.revision > 0 && is_behind &&
      (!robot.last_update || status.time - *robot.last_update > longest_without_update_s(status)))
    out.push_back(robot_alert(robot, "uncorrected", Severity::warning, "does not use the map",
                              "The way down may be cut: it hears no proxy graph."));
  if (own.health.battery_percent && *own.health.battery_percent < kLowBattery_percent)
    out.push_back(robot_alert(robot, "battery", Severity::error,
                              fmt::format("battery at {:.0f} %", *own.health.battery_percent), "Bring it home."));
  if (robot.refused > 0)
    out.push_back(robot_alert(robot, "refused", Severity::warning,
                              fmt::format("{} submaps are no good and not in the map", robot.refused),
                              "See the server's log.txt for why."));
  if (robot.unread > 0)
    out.push_back(robot_alert(robot, "unread", Severity::warning,
                              fmt::format("{} submaps are of a newer version than this server reads", robot.unread),
                              "Upgrade the server; the robot keeps them until then."));
}

Alert server_alert(const char* kind, Severity severity, std::string what, std::string todo) {
  return {.id = fmt::format("server/{}", kind),
          .severity = severity,
          .what = std::move(what),
          .where = "server",
          .todo = std::move(todo)};
}

/// Robots that use the newest map cannot do more: it is the server that is late with the next.
void check_age_of_map(const MissionStatus& status, std::vector<Alert>& out) {
  std::optional<Timestamp> newest;
  for (const MissionStatus::Robot& robot : status.robots)
    if (robot.last_update && (!newest || *newest < *robot.last_update)) newest = robot.last_update;
  if (!status.has_news || !newest || status.time - *newest <= longest_without_update_s(status)) return;
  Alert alert = server_alert("late", Severity::warning, "no new map although submaps have come",
                             "Many submaps, wrong closures or too little CPU make an update long: look at the server's "
                             "machine. Robots use the last map meanwhile.");
  alert.since_s = *newest - Timestamp{};
  out.push_back(std::move(alert));
}

void sort(std::vector<Alert>& alerts) {
  std::ranges::sort(alerts, {}, [](const Alert& alert) { return std::tuple(alert.severity, alert.since_s, alert.id); });
}

}  // namespace

std::vector<Alert> joined(std::vector<Alert> alerts, const std::vector<Alert>& more) {
  alerts.insert(alerts.end(), more.begin(), more.end());
  sort(alerts);
  return alerts;
}

std::vector<Alert> Alerts::dated(std::vector<Alert> found, std::map<std::string, double>& since, double now_s) {
  std::map<std::string, double> next;
  for (Alert& alert : found) {
    if (alert.since_s == 0.0) {
      const auto known = since.find(alert.id);
      alert.since_s = known == since.end() ? now_s : known->second;
    }
    next[alert.id] = alert.since_s;
  }
  since = std::move(next);
  sort(found);
  return found;
}

std::vector<Alert> Alerts::of_status(const MissionStatus& status) {
  std::vector<Alert> out;
  if (!status.trouble.empty())
    out.push_back(server_alert("trouble", Severity::error, status.trouble, "See the server's log.txt."));
  if (status.waiting > 0)
    out.push_back(server_alert(
        "waiting", Severity::warning,
        fmt::format("{} pairs or refinements wait for a worker that can: {}", status.waiting, status.why_waiting),
        "Start a worker of this server's version."));
  if (status.pending_jobs > kManyWaitingJobs)
    out.push_back(server_alert("jobs", Severity::info, fmt::format("{} jobs wait for workers", status.pending_jobs),
                               "Closures come late. Start more workers (tutti worker)."));
  check_age_of_map(status, out);
  for (const MissionStatus::Robot& robot : status.robots) check_robot(status, robot, silent_s_, out);
  return dated(std::move(out), status_since_, status.time - Timestamp{});
}

std::vector<Alert> Alerts::of_map(const mapfile::ShownMap& map, const std::map<SubmapId, std::size_t>& holding) {
  std::vector<Alert> out;
  const server::ClosureNames names = map.content.closure_names();
  const server::MapComponents components = server::choose_components(map.map);
  for (const auto& [robot, component] : components.of_robot) {
    if (component == components.largest) continue;
    Alert alert{.id = fmt::format("map/{}/alone", robot.value),
                .severity = Severity::info,
                .what = "its component of the map is merged with no other",
                .where = names.of(ChainId(robot)),
                .todo = "Let it see a place that another robot has seen; or ask why there is no closure.",
                .robot = robot};
    for (const auto& [chain, part] : components.of_chain)
      if (chain.robot == robot) alert.where = names.of(chain);
    out.push_back(std::move(alert));
  }
  for (const server::FailedOdometry& failed : map.map.failed_odometry)
    out.push_back({.id = fmt::format("map/{}/odometry/{}", to_string(failed.chain), failed.from),
                   .severity = Severity::warning,
                   .what = fmt::format("odometry failed by {:.2f} m between keyframes {} and {}", failed.jump_m,
                                       failed.from, failed.to),
                   .where = names.of(failed.chain),
                   .todo = "The map does without it: closures agree with each other against it.",
                   .robot = failed.chain.robot});
  std::set<ChainId> hanging;
  for (const auto& [submap, closures] : holding)
    if (closures == 1 && hanging.insert(submap.chain).second)
      out.push_back({.id = fmt::format("map/{}/hangs", to_string(submap.chain)),
                     .severity = Severity::warning,
                     .what = "its component hangs on one closure",
                     .where = names.of(submap.chain),
                     .todo = "Look at that closure; another meeting would settle it.",
                     .robot = submap.chain.robot});
  return dated(std::move(out), map_since_, map.time - Timestamp{});
}

void Alerts::resume(std::string_view alerts) {
  const FieldJson all = FieldJson::parse(alerts, nullptr, false);
  if (!all.is_array()) return;
  for (const FieldJson& one : all)
    if (one.contains("id") && one["id"].is_string() && one.contains("since_s") && one["since_s"].is_number())
      status_since_[one["id"]] = map_since_[one["id"]] = one["since_s"].get<double>();
}

}  // namespace tutti::page
