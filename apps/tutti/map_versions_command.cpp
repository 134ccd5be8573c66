// SPDX-License-Identifier: BSD-3-Clause
// tutti map log, diff, revert: a map of several days.
#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <ctime>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "map_command.hpp"
#include "options.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/grids/map_changes.hpp"
#include "tutti/mapfile/versions.hpp"

namespace tutti::app {
namespace {

using mapfile::Version;
using Chains = std::set<ChainId>;

constexpr std::size_t kMostThings = 20;

/// A copy of a map's file, its estimate and its versions.
struct ReadMap {
  std::unique_ptr<storage::TableStore> store;
  mapfile::Content content;
  server::MapEstimate map;
  std::vector<Version> versions;
};

Result<ReadMap> read_map(const std::string& file) {
  ReadMap out;
  auto store = mapfile::open_copy(file);
  if (!store) return tl::unexpected(store.error());
  out.store = std::move(*store);
  auto content = mapfile::read(*out.store);
  if (!content) return in_context(file, content.error());
  out.content = std::move(*content);
  auto versions = mapfile::versions(*out.store);
  if (!versions) return in_context(file, versions.error());
  out.versions = std::move(*versions);
  out.map = mapfile::estimate(out.content);
  return out;
}

std::string names_of(const Chains& chains, const mapfile::Content& content) {
  const server::ClosureNames names = content.closure_names();
  std::string out;
  for (const ChainId& chain : chains) out += (out.empty() ? "" : ", ") + names.of(chain);
  return out;
}

int show_log(const std::string& file) {
  const auto map = read_map(file);
  if (!map) return complain("map log", map.error().message);
  fmt::print("{:>7}  {:<16} {:>8} {:>10} {:>8} {:>9} {:>13}  {}\n", "version", "held (UTC)", "submaps", "keyframes",
             "minutes", "closures", "with earlier", "sessions");
  const auto sizes = mapfile::sizes_of(map->versions, map->content, map->map);
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    const Version& version = map->versions[k];
    const mapfile::VersionSize& size = sizes[k];
    const std::string held =
        version.held_ns == 0
            ? "not held"
            : fmt::format("{:%F %H:%M}", fmt::gmtime(static_cast<std::time_t>(version.held_ns / 1'000'000'000)));
    fmt::print("{:>7}  {:<16} {:>8} {:>10} {:>8.1f} {:>9} {:>13}  {}\n", version.number, held, size.submaps,
               size.keyframes, size.minutes, size.own_closures, size.earlier_closures,
               names_of(version.chains, map->content));
  }
  return 0;
}

struct DiffOptions {
  std::vector<std::string> maps;
  std::optional<std::uint64_t> version;
  std::string ply;
  grids::ChangeConfig changes;
};

/// Which sessions are compared.
struct Compared {
  Chains before, since;
};

Result<Compared> compared_versions(const ReadMap& map, std::optional<std::uint64_t> number, const std::string& file) {
  const std::uint64_t which = number.value_or(map.versions.back().number);
  Compared out;
  bool is_there = false;
  for (const Version& version : map.versions) {
    if (version.number < which) out.before.insert(version.chains.begin(), version.chains.end());
    if (version.number == which) out.since = version.chains;
    is_there = is_there || version.number == which;
  }
  if (!is_there || out.before.empty())
    return fail(ErrorCode::invalid,
                "{}: has {}, expected one that has another before it (tutti map log {}), or two maps", file,
                map.versions.size() == 1 ? "one version" : fmt::format("no version {}", which), file);
  return out;
}

/// Prints how far poses of `before` have moved.
Result<Compared> compared_maps(const ReadMap& before, const ReadMap& map, const DiffOptions& options) {
  Compared out;
  const Chains there = map.content.chains();
  for (const ChainId& chain : before.content.chains())
    if (there.contains(chain)) out.before.insert(chain);
  std::ranges::set_difference(there, out.before, std::inserter(out.since, out.since.end()));
  if (out.before.empty() || out.since.empty())
    return fail(ErrorCode::invalid,
                "{} has {} session of {}, expected a later version of it: one that --extend made, or a server went on "
                "with; other maps can be merged first (tutti map merge)",
                options.maps.back(), out.before.empty() ? "no" : "every", options.maps.front());
  std::vector<double> moved_m;
  for (const MapNode& node : before.map.nodes)
    if (const MapNode* now = server::find_node(map.map, node.id))
      moved_m.push_back((now->T_world_body.translation - node.T_world_body.translation).norm());
  if (!moved_m.empty())
    fmt::print("poses of {}: {} in both, moved by {:.3f} m at most\n", options.maps.front(), moved_m.size(),
               *std::ranges::max_element(moved_m));
  return out;
}

Result<Compared> compared(const ReadMap& map, const DiffOptions& options) {
  if (options.maps.size() == 1) return compared_versions(map, options.version, options.maps.front());
  const auto before = read_map(options.maps.front());
  if (!before) return tl::unexpected(before.error());
  return compared_maps(*before, map, options);
}

void print_things(const grids::Changes& changes, bool appeared) {
  std::size_t count = 0, left_out = 0;
  for (const grids::ChangedThing& thing : changes.things) {
    if (thing.appeared != appeared) continue;
    if (count == 0)
      fmt::print("\n{:<24} {:>6}   {:<27}   {}\n", appeared ? "is there since" : "is there no more", "cubes",
                 "middle x, y, z, m", "size, m");
    if (++count > kMostThings) {
      ++left_out;
      continue;
    }
    fmt::print("{:<24} {:>6}   {:>8.2f} {:>8.2f} {:>8.2f}    {:.1f} x {:.1f} x {:.1f}\n", "", thing.cubes,
               thing.centre.x(), thing.centre.y(), thing.centre.z(), thing.size.x(), thing.size.y(), thing.size.z());
  }
  if (left_out > 0) fmt::print("{:<24} and {} smaller ones\n", "", left_out);
  if (count == 0) fmt::print("\n{}: nothing\n", appeared ? "is there since" : "is there no more");
}

Status write_changes(const grids::Changes& changes, const std::string& file) {
  constexpr formats::Rgb kAppeared{40, 160, 60}, kGone{200, 50, 40}, kUnsure{150, 150, 150};
  std::vector<Eigen::Vector3f> points;
  std::vector<formats::Rgb> colours;
  for (const auto& [cubes, colour] :
       {std::pair(&changes.appeared, kAppeared), std::pair(&changes.gone, kGone), std::pair(&changes.unsure, kUnsure)})
    for (const Eigen::Vector3d& cube : *cubes) {
      points.push_back(cube.cast<float>());
      colours.push_back(colour);
    }
  if (auto made = make_folder_of(file); !made) return made;
  const std::vector<std::string> comments{"green: is there since; red: is there no more; grey: too few to be sure"};
  return formats::write_ply(file, points, colours, {}, comments);
}

int show_diff(const DiffOptions& options) {
  constexpr const char* kDiff = "map diff";
  if (options.maps.size() == 2 && options.version)
    return complain(kDiff, "--version is one of one map: give either two maps, or one and its version", 2);
  const std::string& file = options.maps.back();
  const auto map = read_map(file);
  if (!map) return complain(kDiff, map.error().message);
  const auto sessions = compared(*map, options);
  if (!sessions) return complain(kDiff, sessions.error().message);
  const auto changes =
      grids::changes_of_map(*map->store, map->content, map->map, sessions->before, sessions->since, options.changes);
  if (!changes) return complain(kDiff, file + ": " + changes.error().message);
  fmt::print("before: {}\nsince:  {}\n", names_of(sessions->before, map->content),
             names_of(sessions->since, map->content));
  fmt::print("cubes of {:g} m: {} with something both times, {} new, {} gone, {} too few to be sure\n",
             options.changes.voxel_m, changes->same, changes->appeared.size(), changes->gone.size(),
             changes->unsure.size());
  fmt::print("not comparable: {} where nobody looked before, {} where nobody looked since\n", changes->unseen_before,
             changes->unseen_now);
  print_things(*changes, true);
  print_things(*changes, false);
  if (options.ply.empty()) return 0;
  if (auto written = write_changes(*changes, options.ply); !written) return complain(kDiff, written.error().message);
  fmt::print("\n{}\n", options.ply);
  return 0;
}

struct RevertOptions {
  std::string map, out;
  std::uint64_t to = 1;
};

int revert_map(const RevertOptions& options) {
  const auto left_out = mapfile::revert(options.map, options.to, options.out);
  if (!left_out) return complain("map revert", left_out.error().message);
  fmt::print("{}: version {} of {}; {} submaps of later versions are left out\n", options.out, options.to, options.map,
             *left_out);
  return 0;
}

void add_diff_command(CLI::App& map, int& exit_code) {
  const auto options = std::make_shared<DiffOptions>();
  CLI::App* diff = map.add_subcommand(
      "diff",
      "What was there and is no more, and what is there since: by what was seen, and seen through, in either time.");
  diff->footer(
      "With one map: its newest version against those before. With two: what the second has beyond the first.\n"
      "Example: tutti map diff site.tutti && tutti map diff monday.tutti tuesday.tutti --ply changes.ply\n");
  diff->add_option("maps", options->maps, "A map with several versions, or a map and a later version of it.")
      ->type_name("MAP")
      ->required()
      ->expected(1, 2);
  diff->add_option("--version", options->version, "Which version against those before it; default: the newest.")
      ->type_name("N");
  diff->add_option("--ply", options->ply, "Also write the cubes that changed: green is there since, red no more.")
      ->type_name("FILE.ply");
  diff->add_option("--voxel", options->changes.voxel_m, "Edge of the cubes; at least that of submaps' clouds.")
      ->type_name("M")
      ->check(within(0.05, 10.0))
      ->capture_default_str();
  diff->add_option("--range", options->changes.range_m, "What is farther from a robot's trajectory is not used.")
      ->type_name("M")
      ->check(within(0.5, 1000.0))
      ->capture_default_str();
  diff->callback([options, &exit_code] { exit_code = show_diff(*options); });
}

}  // namespace

void add_map_versions_commands(CLI::App& map, int& exit_code) {
  const auto file = std::make_shared<std::string>();
  CLI::App* log = map.add_subcommand(
      "log", "The versions of a map: each is what was added until its poses were held, by --extend or --frozen.");
  log->add_option("map", *file, "The map's file.")->type_name("MAP")->required();
  log->callback([file, &exit_code] { exit_code = show_log(*file); });

  add_diff_command(map, exit_code);

  const auto options = std::make_shared<RevertOptions>();
  CLI::App* revert = map.add_subcommand("revert", "A map as it was in an earlier version, as a new file.");
  revert->footer("Example: tutti map revert site.tutti --to 1 -o before.tutti\n");
  revert->add_option("map", options->map, "The map's file; it stays as it is.")->type_name("MAP")->required();
  revert->add_option("--to", options->to, "The version; tutti map log lists them.")->type_name("N")->required();
  revert->add_option("-o,--output", options->out, "The map to be made; it must not be there.")
      ->type_name("MAP")
      ->required();
  revert->callback([options, &exit_code] { exit_code = revert_map(*options); });
}

}  // namespace tutti::app
