// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/node/status_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <optional>
#include <vector>

#include "tutti/base/field_text.hpp"

namespace tutti::node {
namespace {

std::string duration(double s) {
  if (s < 120.0) return fmt::format("{:.0f} s", std::max(0.0, s));
  if (s < 7200.0) return fmt::format("{:.0f} min", s / 60.0);
  return fmt::format("{:.0f} h", s / 3600.0);
}

std::string ago(Timestamp now, const std::optional<Timestamp>& then) {
  return then ? duration(now - *then) + " ago" : "never";
}

std::string size(std::uint64_t bytes) {
  const auto number = static_cast<double>(bytes);
  if (bytes < 1000) return fmt::format("{} B", bytes);
  return bytes < 1'000'000 ? fmt::format("{:.1f} kB", number / 1e3) : fmt::format("{:.1f} MB", number / 1e6);
}

std::string backlog(const NodeStatus& status) {
  return status.backlog_submaps == 0 ? "-" : fmt::format("{} ({})", status.backlog_submaps, size(status.backlog_bytes));
}

using Row = std::vector<std::string>;

void append_table(const std::vector<Row>& rows, std::string& out) {
  std::vector<std::size_t> widths(rows.front().size(), 0);
  for (const Row& row : rows)
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  for (const Row& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) line += fmt::format("{:<{}}  ", row[i], widths[i]);
    line.erase(line.find_last_not_of(' ') + 1);
    out += line + "\n";
  }
}

/// The fields that ask for a column, as far as any robot has a value.
void append_columns(const std::vector<MissionStatus::Robot>& robots, std::vector<Row>& rows) {
  std::vector<std::vector<std::pair<std::string, std::string>>> columns;
  for (const MissionStatus::Robot& robot : robots) columns.push_back(field_columns(robot));
  for (std::size_t c = 0; c < columns.front().size(); ++c) {
    if (std::ranges::all_of(columns, [c](const auto& of) { return of[c].second.empty(); })) continue;
    rows.front().push_back(columns.front()[c].first);
    for (std::size_t i = 0; i < robots.size(); ++i)
      rows[i + 1].push_back(columns[i][c].second.empty() ? "-" : columns[i][c].second);
  }
}

std::string state(const MissionStatus::Robot& robot) {
  std::string state = robot.status.finished ? "finished" : "maps";
  if (const InMap& in_map = robot.status.in_map; !in_map.map.empty() && !robot.status.finished)
    state = fmt::format("in version {} of map {}{}", in_map.version, in_map.map,
                        in_map.floor > 1 ? fmt::format(", floor {}", in_map.floor) : "");
  if (!robot.last_seen) state = "not seen since the server started";
  if (!robot.status.trouble.empty()) state += ": " + robot.status.trouble;
  return state;
}

/// Says where the map that robots localise in has changed, as they have found.
void append_places(const MissionStatus& status, std::string& out) {
  constexpr std::size_t kMostShown = 20;
  std::vector<const MissionStatus::Place*> changed;
  std::uint64_t oldest_s = 0;
  for (const MissionStatus::Place& place : status.places) {
    oldest_s = std::max(oldest_s, place.age_s);
    if (place.missing + place.appeared > 0) changed.push_back(&place);
  }
  const auto since = [](std::uint64_t s) { return duration(static_cast<double>(s)); };
  out += fmt::format("map {}, version {}: {} of its submaps were seen, the first of them {} ago, and ",
                     status.places_map, status.places_version, status.places.size(), since(oldest_s));
  out += changed.empty() ? "none has changed\n" : "something has changed in\n";
  if (changed.empty()) return;
  std::ranges::stable_sort(changed, {}, &MissionStatus::Place::trust);
  std::vector<Row> rows{{"submap", "cubes gone", "new", "fits", "seen last", "by"}};
  for (const MissionStatus::Place* const place : changed) {
    if (rows.size() > kMostShown) break;
    std::string by;
    for (const RobotId robot : place->robots) {
      const auto known = std::ranges::find(status.robots, robot, &MissionStatus::Robot::robot);
      by += (by.empty() ? "" : ", ") +
            (known == status.robots.end() ? fmt::format("robot {}", robot.value) : known->status.name);
    }
    rows.push_back({place->name, std::to_string(place->missing), std::to_string(place->appeared),
                    fmt::format("{:.1f} %", 100.0 * place->trust), since(place->age_s) + " ago", std::move(by)});
  }
  append_table(rows, out);
  if (changed.size() >= rows.size()) out += fmt::format("and {} more\n", changed.size() + 1 - rows.size());
}

}  // namespace

std::string mission_status_text(const MissionStatus& status, double silent_s) {
  std::string out;
  const auto say = [&out]<class... Args>(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(out), format, std::forward<Args>(args)...);
  };
  if (silent_s > 0.0) say("No server: last seen {} ago. What it reported then:\n", duration(silent_s));
  say("server {}: {} submaps, {} closures, {}; revision {}{}{}\n", status.version, status.submaps, status.closures,
      status.components > 1 ? fmt::format("{} components that no closure merges yet", status.components) : "one map",
      status.revision, status.has_news ? ", the next is due" : "",
      status.pending_jobs > 0 ? fmt::format(", {} jobs wait", status.pending_jobs) : "");
  if (!status.trouble.empty()) say("trouble: {}\n", status.trouble);
  if (!status.verifier.empty()) say("closures are found by {}\n", status.verifier);
  if (status.former_pairs > 0)
    say("between {} pairs of submaps they are another verifier's, until this one has answered\n", status.former_pairs);
  if (status.retired > 0)
    say("{} submaps show known ground and are retired; the map is made of {}\n", status.retired,
        status.submaps - std::min(status.submaps, status.retired));
  if (status.waiting > 0)
    say("{} pairs of submaps or refinements wait for a worker that can: {}\n", status.waiting, status.why_waiting);
  if (status.robots.empty() && status.workers.empty()) say("Nobody is there: no robot and no worker.\n");
  if (!status.robots.empty()) {
    std::vector<Row> rows{{"robot", "last seen", "backlog", "last update", "revision", "submaps", "alerts"}};
    for (const MissionStatus::Robot& robot : status.robots)
      rows.push_back({robot.status.name, ago(status.time, robot.last_seen), backlog(robot.status),
                      ago(status.time, robot.last_update),
                      robot.status.heard_epoch == status.epoch ? std::to_string(robot.status.heard_revision) : "-",
                      std::to_string(robot.submaps), std::to_string(robot.status.alerts)});
    append_columns(status.robots, rows);
    rows.front().push_back("state");
    for (std::size_t i = 0; i < status.robots.size(); ++i) rows[i + 1].push_back(state(status.robots[i]));
    append_table(rows, out);
  }
  if (!status.workers.empty()) {
    std::vector<Row> rows{{"worker", "last seen", "jobs done", "state"}};
    for (const MissionStatus::Worker& worker : status.workers)
      rows.push_back({worker.status.name, ago(status.time, worker.last_seen), std::to_string(worker.status.jobs_done),
                      worker.status.trouble});
    append_table(rows, out);
  }
  if (!status.places.empty()) append_places(status, out);
  for (const MissionStatus::Robot& robot : status.robots) {
    if (!robot.conflict.empty()) say("two robots: {}\n", robot.conflict);
    if (robot.refused > 0) say("{}: {} submaps are no good and not in the map\n", robot.status.name, robot.refused);
    if (robot.unread > 0)
      say("{}: {} submaps are of a newer version than this server reads; the robot keeps them until it is upgraded\n",
          robot.status.name, robot.unread);
  }
  for (const MissionStatus::Refusals& refusals : status.refusals)
    say("refused from {}s: {} x {}, the last because: {}\n", refusals.from, refusals.count, refusals.kind,
        refusals.last_why);
  return out;
}

}  // namespace tutti::node
