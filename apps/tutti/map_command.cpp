// SPDX-License-Identifier: BSD-3-Clause
// tutti map: maps as files that no server has open.
#include "map_command.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "commands.hpp"
#include "options.hpp"
#include "tutti/mapfile/closures.hpp"
#include "tutti/mapfile/floors.hpp"
#include "tutti/mapfile/merge.hpp"
#include "tutti/mapfile/salvage.hpp"
#include "tutti/mapfile/why.hpp"

namespace tutti::app {
namespace {

namespace fs = std::filesystem;

/// As storage/sqlite_store.cpp marks its files; what kind of store it is, opening it shows.
bool looks_like_ours(const fs::path& file) {
  std::string head(72, '\0');
  std::ifstream(file, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
  return head.starts_with("SQLite format 3") && head.substr(68, 4) == "Tutt";
}

/// The later change of the file and of the log that is part of it after a crash.
std::string last_change(const fs::path& file) {
  std::error_code failure;
  fs::file_time_type last = fs::last_write_time(file, failure);
  const auto log = fs::last_write_time(file.string() + "-wal", failure);
  if (!failure) last = std::max(last, log);
  const auto time = std::chrono::file_clock::to_sys(last);
  return fmt::format(
      "{:%F %H:%M}",
      fmt::gmtime(std::chrono::system_clock::to_time_t(std::chrono::time_point_cast<std::chrono::seconds>(time))));
}

std::string size_of(std::uint64_t bytes) {
  return bytes < 1'000'000 ? fmt::format("{:.1f} kB", 1e-3 * static_cast<double>(bytes))
                           : fmt::format("{:.1f} MB", 1e-6 * static_cast<double>(bytes));
}

struct Counts {
  std::size_t robots = 0, sessions = 0, pairs = 0;
};

Counts count(const mapfile::Content& content) {
  std::set<RobotId> robots;
  std::set<ChainId> chains;
  for (const auto& [id, submap] : content.submaps) {
    robots.insert(id.chain.robot);
    chains.insert(id.chain);
  }
  const auto found = std::ranges::count_if(content.verdicts, [](const auto& v) { return !v.second.closures.empty(); });
  return {robots.size(), chains.size(), static_cast<std::size_t>(found)};
}

int list_maps(const fs::path& folder) {
  std::error_code failure;
  if (!fs::is_directory(folder, failure))
    return complain("map list", folder.string() + ": no such folder; of one file: tutti map info");
  std::vector<fs::path> files;
  const auto options = fs::directory_options::skip_permission_denied;
  for (auto at = fs::recursive_directory_iterator(folder, options, failure); at != fs::end(at); at.increment(failure)) {
    if (at.depth() > 2) at.disable_recursion_pending();
    if (at->is_regular_file(failure) && looks_like_ours(at->path())) files.push_back(at->path());
  }
  std::ranges::sort(files);
  bool any = false;
  const auto print = [&](const auto&... columns) {
    if (!any)
      fmt::print("{:<32} {:>10} {:>7} {:>9} {:>8} {:>9}  {}\n", "map", "size", "robots", "sessions", "submaps",
                 "closures", "last change (UTC)");
    any = true;
    fmt::print("{:<32} {:>10} {:>7} {:>9} {:>8} {:>9}  {}\n", columns...);
  };
  for (const fs::path& file : files) {
    const std::string changed = last_change(file), name = fs::relative(file, folder, failure).string();
    const std::string size = size_of(fs::file_size(file, failure));
    const auto map = mapfile::open(file);
    if (!map && map.error().message.find("holds a") != std::string::npos) continue;  // a robot's
    const auto content = map ? mapfile::read(**map) : tl::unexpected(map.error());
    if (!content) {
      fmt::print(stderr, "{}\n", content.error().message);
      print(name, size, "?", "?", "?", "?", changed);
      continue;
    }
    const Counts counts = count(*content);
    print(name, size, counts.robots, counts.sessions, content->submaps.size(), counts.pairs, changed);
  }
  if (!any) fmt::print("{}: no maps\n", folder.string());
  return 0;
}

void print_tables(const mapfile::Content& content) {
  fmt::print("\n{:<10} {:>8} {:>12}  {}\n", "table", "rows", "bytes", "rows by version of their message");
  for (const auto& [name, table] : content.tables) {
    std::string versions;
    for (const auto& [version, rows] : table.versions)
      versions += fmt::format("{}v{}: {}", versions.empty() ? "" : ", ", version, rows);
    if (table.unread > 0)
      versions += fmt::format("{}of versions that this program does not read, and left out: {}",
                              versions.empty() ? "" : ", ", table.unread);
    fmt::print("{:<10} {:>8} {:>12}  {}\n", name, table.rows, table.bytes, versions);
  }
}

void print_robots(const mapfile::Content& content, const server::MapEstimate& map) {
  const server::ClosureNames names = content.closure_names();
  const mapfile::Floors floors = mapfile::Floors::of(content, map);
  struct Session {
    std::size_t submaps = 0, keyframes = 0;
    std::set<std::uint32_t> floors;
    Timestamp first = kLastTimestamp, last = kFirstTimestamp;
  };
  std::map<ChainId, Session> sessions;
  for (const auto& [id, submap] : content.submaps) {
    Session& session = sessions[id.chain];
    ++session.submaps;
    session.first = std::min(session.first, submap->keyframes.front().stamp);
    session.last = std::max(session.last, submap->keyframes.back().stamp);
  }
  for (const MapNode& node : map.nodes) {
    Session& session = sessions[node.id.chain];
    ++session.keyframes;
    if (const auto floor = floors.of_component(node.component)) session.floors.insert(*floor);
  }
  fmt::print("\n{:<20} {:>10} {:>20} {:>8} {:>9} {:>8}  {}\n", "robot", "number", "session", "submaps", "keyframes",
             "minutes", "floor");
  for (const auto& [chain, session] : sessions) {
    fmt::print("{:<20} {:>10} {:>20} {:>8} {:>9} {:>8.1f}  {}\n", names.of(chain), chain.robot.value, chain.session,
               session.submaps, session.keyframes, (session.last - session.first) / 60.0,
               session.floors.empty() ? "-" : fmt::format("{}", fmt::join(session.floors, ", ")));
  }
  for (const mapfile::Lift& lift : mapfile::lifts_of(floors, map)) {
    const Eigen::Vector3d &from = lift.from.T_world_body.translation, &to = lift.to.T_world_body.translation;
    fmt::print(
        "lift         from floor {} at {:.2f}, {:.2f}, {:.2f} m ({}) to floor {} at {:.2f}, {:.2f}, {:.2f} m ({})\n",
        lift.from.floor, from.x(), from.y(), from.z(), names.of(lift.from.chain), lift.to.floor, to.x(), to.y(), to.z(),
        names.of(lift.to.chain));
  }
}

void print_verifiers(const mapfile::Content& content) {
  std::map<MethodId, std::size_t> found;
  for (const auto& [pair, verdict] : content.verdicts)
    if (!verdict.closures.empty()) ++found[verdict.verifier];
  for (const auto& [verifier, pairs] : content.refused) found.try_emplace(verifier, 0);
  for (const auto& [verifier, pairs] : found)
    fmt::print("verifier     {}: closures between {} pairs, {} refused\n", to_string(verifier), pairs,
               content.refused.contains(verifier) ? content.refused.at(verifier) : 0);
  for (const auto& [verifier, pairs] : content.aside)
    fmt::print("verifier     {}: closures between {} pairs that are not believed\n", to_string(verifier), pairs);
}

int show_map(const fs::path& file) {
  const std::string changed = last_change(file);
  const auto map = mapfile::open(file);
  if (!map) return complain("map info", map.error().message);
  const auto content = mapfile::read(**map);
  if (!content) return complain("map info", content.error().message);
  std::error_code failure;
  fmt::print(
      "map          {}\nsize         {}\nlast change  {} UTC\nserver       epoch {}, revision {}, opened {} times{}\n",
      file.string(), size_of(fs::file_size(file, failure)), changed, content->meta.epoch, content->meta.revision,
      content->meta.start, content->meta.news ? ", with news since" : "");
  const Counts counts = count(*content);
  fmt::print("submaps      {} of {} robots, {} sessions\nfound        closures between {} pairs\n",
             content->submaps.size(), counts.robots, counts.sessions, counts.pairs);
  if (const auto& last = content->counts)
    fmt::print("last update  revision {}: {} keyframes, {} closures accepted, {} components\n", last->revision,
               last->keyframes, last->closures, last->components);
  print_verifiers(*content);
  print_tables(*content);
  std::fflush(stdout);  // what follows takes as long as an update of the map

  const server::MapEstimate estimate = mapfile::estimate(*content);
  std::map<std::string, std::size_t> states;
  std::size_t by_operator = 0;
  for (const mapfile::ClosureInfo& info : mapfile::closures(*content, estimate)) {
    ++states[to_string(info.state)];
    if (info.decision && info.decision->wish != Wish::withdraw) ++by_operator;
  }
  fmt::print("\nclosures     {} accepted, {} rejected, {} candidates; {} by an operator's decision\n",
             states["accepted"], states["rejected"], states["candidate"], by_operator);
  fmt::print("joint map    {} keyframes, {} components\n", estimate.nodes.size(), estimate.components);
  if (const auto& earth = estimate.fixes.georeference)
    fmt::print(
        "origin       latitude {:.9f}, longitude {:.9f}, height {:.3f} m (enu); fixes of {} of {} submaps count\n",
        earth->origin.latitude_deg, earth->origin.longitude_deg, earth->origin.height_m,
        std::ranges::count(estimate.fixes.judged, server::FixObjection::none, &server::JudgedFixes::objection),
        estimate.fixes.judged.size());
  std::size_t ranges = 0, used = 0;
  for (const server::JudgedRanges& judged : estimate.ranges.judged) {
    ranges += judged.ranges;
    used += judged.used;
  }
  if (ranges > 0) fmt::print("ranges       {} of {} between robots count\n", used, ranges);
  print_robots(*content, estimate);
  return 0;
}

struct MergeOptions {
  std::vector<std::string> maps;
  std::string out;
};

int merge_maps(const MergeOptions& options) {
  const auto merged = mapfile::merge(fs::path(options.maps[0]), fs::path(options.maps[1]), fs::path(options.out));
  if (!merged) return complain("map merge", merged.error().message);
  fmt::print("{}: {} submaps, of which {} were in both\n", options.out, merged->submaps, merged->shared);
  for (const auto& [from, to] : merged->renumbered)
    fmt::print("robot {}, session {} of {} is robot {}, session {} in it\n", from.robot.value, from.session,
               options.maps[1], to.robot.value, to.session);
  return 0;
}

int salvage_map(const fs::path& in, const fs::path& out) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto salvaged = mapfile::salvage(
      in, out, static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()));
  if (!salvaged) return complain("map salvage", salvaged.error().message);
  for (const std::string& lost : salvaged->lost) fmt::print("lost  {}\n", lost);
  std::string rows;
  for (const auto& [table, count] : salvaged->rows)
    rows += fmt::format("{}{} {}", rows.empty() ? "" : ", ", count, table);
  fmt::print("{}: {}; {}\n", out.string(), rows.empty() ? "no rows" : rows,
             salvaged->kind == "robot" ? "the robot that opens it sends these submaps and begins a session"
             : salvaged->lost.empty()  ? "nothing is lost"
                                       : "robots send again what they have of the rest");
  return 0;
}

struct WhyOptions {
  std::string map;
  std::vector<std::string> robots;
};

int tell_why(const WhyOptions& options) {
  constexpr const char* kWhy = "map why";
  const auto map = mapfile::open_copy(options.map);
  if (!map) return complain(kWhy, map.error().message);
  const auto content = mapfile::read(**map);
  if (!content) return complain(kWhy, content.error().message);
  const auto why = mapfile::why_not_joined(**map, *content, mapfile::estimate(*content), options.robots.front(),
                                           options.robots.back());
  if (!why) return complain(kWhy, why.error().message, 2);
  fmt::print("{}.\n", why->sentence);
  if (!why->stopped_by.empty()) fmt::print("\n{:>8}  stopped by\n", "pairs");
  for (const auto& [reason, count] : why->stopped_by) fmt::print("{:>8}  {}\n", count, reason);
  if (!why->nearest.empty()) fmt::print("\n{:<24} {:<44} {}\n", "nearest", "stopped by", "what would help");
  for (const mapfile::NearMiss& miss : why->nearest)
    fmt::print("{:<24} {:<44} {}\n", miss.name, miss.reason, miss.hint);
  return 0;
}

}  // namespace

void add_map_command(CLI::App& app, int& exit_code) {
  CLI::App* map = app.add_subcommand("map",
                                     "Look into maps, export, merge and publish them, and decide which closures are "
                                     "right. On files that no server has open, but for 'export' and 'publish'.");
  map->require_subcommand(1);

  const auto folder = std::make_shared<std::string>(".");
  CLI::App* list =
      map->add_subcommand("list", "The maps in a folder: size, robots, sessions, submaps, pairs with closures.");
  list->add_option("folder", *folder, "Where to look, three levels deep.")->type_name("DIR")->capture_default_str();
  list->callback([folder, &exit_code] { exit_code = list_maps(*folder); });

  const auto file = std::make_shared<std::string>();
  CLI::App* info = map->add_subcommand("info", "What one map holds: sessions, closures, bytes and versions.");
  info->add_option("map", *file, "The map's file.")->type_name("MAP")->required();
  info->callback([file, &exit_code] { exit_code = show_map(*file); });

  add_export_command(*map, exit_code);

  const auto asked = std::make_shared<WhyOptions>();
  CLI::App* why = map->add_subcommand(
      "why",
      "Why two robots' maps are not merged: which of their submaps came nearest to a closure, and what stopped it.");
  why->footer("Also of a map that a server has open. Example: tutti map why state/map.tutti alpha bravo\n");
  why->add_option("map", asked->map, "The map's file.")->type_name("MAP")->required();
  why->add_option("robots", asked->robots, "The two robots.")->type_name("ROBOT")->required()->expected(2);
  why->callback([asked, &exit_code] { exit_code = tell_why(*asked); });

  const auto merging = std::make_shared<MergeOptions>();
  CLI::App* merge = map->add_subcommand("merge", "Merge two maps into a third; the two stay as they are.");
  merge->footer(
      "The server that opens it looks for closures between them. A robot is the same by its name, and its sessions are "
      "side by side.\nWhere the second map has a number for another robot, or a session for another run, it gets a "
      "free one, which is reported.\n"
      "Example: tutti map merge monday/map tuesday/map -o both/map\n");
  merge->add_option("maps", merging->maps, "The two maps.")->type_name("MAP")->required()->expected(2);
  merge->add_option("-o,--output", merging->out, "The map to be made; it must not be there.")
      ->type_name("MAP")
      ->required();
  merge->callback([merging, &exit_code] { exit_code = merge_maps(*merging); });

  const auto damaged = std::make_shared<std::string>(), whole = std::make_shared<std::string>();
  CLI::App* salvage = map->add_subcommand(
      "salvage",
      "Copy every row of a damaged map, or of a robot's store, that can be read into a new one, and say which cannot.");
  salvage->footer(
      "Example: tutti map salvage state/map.tutti -o salvaged.tutti\n"
      "A robot does this by itself: what it set aside is state/robot.damaged-1.tutti.\n");
  salvage->add_option("map", *damaged, "The damaged file; it stays as it is.")->type_name("MAP")->required();
  salvage->add_option("-o,--output", *whole, "The map to be made; it must not be there.")->type_name("MAP")->required();
  salvage->callback([damaged, whole, &exit_code] { exit_code = salvage_map(*damaged, *whole); });

  add_map_versions_commands(*map, exit_code);
  add_map_publish_command(*map, exit_code);
  add_map_closure_command(*map, exit_code);
}

}  // namespace tutti::app
