// SPDX-License-Identifier: BSD-3-Clause
// The commands that take a mission: run, demo and world.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "commands.hpp"
#include "live_mission.hpp"
#include "options.hpp"
#include "progress_line.hpp"
#include "tutti/base/folder.hpp"
#include "tutti/formats/ply.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/lab/run_mission.hpp"
#include "tutti/mapfile/hold_map.hpp"
#include "tutti/mapfile/known_map.hpp"
#include "tutti/mission/bag_mission.hpp"
#include "tutti/mission/graph_recording.hpp"
#include "tutti/mission/localise_mission.hpp"
#include "tutti/mission/report/localise.hpp"
#include "tutti/mission/report/report.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/program/stop.hpp"
#include "tutti/simulation/surface.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"

namespace tutti::app {
namespace {

namespace fs = std::filesystem;

void show(const mission::Progress& progress, ProgressLine& line) {
  const double share = progress.duration_s > 0.0 ? std::min(1.0, progress.time_s / progress.duration_s) : 1.0;
  const std::string maps = progress.components == 0   ? "no map yet"
                           : progress.components == 1 ? "1 map"
                                                      : fmt::format("{} maps (not merged yet)", progress.components);
  line.show(share, fmt::format("{:4.0f} % of {:.0f} s   {} submaps, {} closures, {}", 100.0 * share,
                               progress.duration_s, progress.submaps, progress.closures, maps));
}

/// The arguments that `run` and `demo` share.
struct MissionArguments {
  fs::path mission, out, map, map_in;
  bool frozen = false, extend = false;
  mission::LocaliseTrial trial;
  mission::RunOptions run{.version = TUTTI_VERSION};
  std::vector<std::string> assignments;
  bool print_config = false;
};

void add_mission_options(CLI::App& command, MissionArguments& arguments) {
  command
      .add_option("-o,--out", arguments.out,
                  "Folder for the report, made if missing; default: out/ and the mission's name")
      ->type_name("DIR");
  command.add_option("--seed", arguments.run.seed, "Everything random comes from this number; default: 1")
      ->type_name("N")
      ->check(whole_number());
  command
      .add_option("--map", arguments.map,
                  "Also write the server's map as a file, for tutti map, tutti export and tutti server")
      ->type_name("MAP");
  add_number(command, "--rate", arguments.run.rate,
             "Times real time, e.g. 1; shows each robot's and the server's CPU share and worst update\n"
             "latency. Without it: as fast as possible",
             "R", within(1e-3, 1e6));
  command.add_option("--threads", arguments.run.threads, "Threads for verifying closures; 0 = all cores")
      ->type_name("N")
      ->check(CLI::Range(0, 1024));
  command
      .add_option("--set", arguments.assignments,
                  "Change a setting, e.g. --set agent.policy.name=spectral or --set agent.submap.duration_s=5;\n"
                  "may be given several times")
      ->type_name("KEY=VALUE");
  command.add_flag("--print-config", arguments.print_config, "Print every setting with its value, and stop");
}

/// Replays the robots in a map that does not move, and reports where they were in it.
Status localise(const lab::MissionConfig& config, const MissionArguments& arguments) {
  const auto map = mapfile::open_known_map(arguments.map_in);
  if (!map) return in_context("--map-in", map.error());
  const auto input = lab::load_input(config, arguments.run.data, arguments.run.seed);
  if (!input) return tl::unexpected(input.error());
  ProgressLine progress;
  const auto stop = announced_stop("what is there is reported");
  const auto follow = mission::follow_by_node(
      config, map->known, [&] { return verifiers::make_verifier(config.closures); }, arguments.trial.restart_s,
      [&](const std::string& robot, double share) {
        progress.show(share, fmt::format("{}: {:4.0f} %", robot, 100.0 * share));
        return stop();
      });
  const auto robots = mission::localise_mission(config, *input, *map, arguments.trial, follow);
  progress.close();
  if (!robots) return tl::unexpected(robots.error());
  if (auto ok = mission::write_localised(*robots, *map->known, arguments.out); !ok) return ok;
  std::cout << mission::localised_text(*robots, *map->known) << "\n"
            << (arguments.out / "localise.json").string() << '\n';
  return {};
}

/// The map that robots of the mission are laid into, and beside each other.
Result<mapfile::HeldMap> map_to_extend(const MissionArguments& arguments) {
  if (arguments.map_in.empty()) return mapfile::HeldMap();
  if (!arguments.extend)
    return fail(ErrorCode::invalid,
                "--map-in {}: say what becomes of it: --frozen, where robots find their places in it, each alone; or "
                "--extend, where they add to it",
                arguments.map_in.string());
  if (arguments.map.empty())
    return fail(ErrorCode::invalid,
                "--extend: say where the map goes with what was added, with --map NEW.tutti: {} is "
                "not changed",
                arguments.map_in.string());
  auto map = mapfile::read_held(arguments.map_in, static_cast<std::int64_t>(program::wall_clock_ns()));
  if (!map) return in_context("--map-in", map.error());
  return map;
}

/// Runs, writes the report, prints the table. Returns the exit code.
int run_and_report(const Result<lab::MissionConfig>& config, MissionArguments& arguments) {
  const auto failed = [](const std::string& message, int exit_code = 1) {
    std::cerr << "tutti: " << message << '\n';
    return exit_code;
  };
  if (!config) return failed(config.error().message, 2);
  if (arguments.print_config) {
    std::cout << to_yaml(*config);
    return 0;
  }
  const std::string out = arguments.out.string();
  if (auto made = make_folder(out); !made) return failed("--out " + made.error().message);  // before the mission
  if (arguments.frozen) {
    const Status localised = localise(*config, arguments);
    return localised ? 0 : failed(localised.error().message);
  }
  auto extended = map_to_extend(arguments);
  if (!extended) return failed(extended.error().message);
  arguments.run.map = std::move(*extended);
  if (!arguments.map.empty()) {
    if (auto made = make_folder_of(arguments.map); !made) return failed("--map " + made.error().message);
    std::error_code failure;
    if (fs::exists(arguments.map, failure))
      return failed(fmt::format("--map {}: is there already", arguments.map.string()), 2);
    arguments.run.keep_map = [&arguments](const storage::TableStore& map) {
      return mapfile::keep_extended(arguments.run.map, map, arguments.map);
    };
  }
  ProgressLine progress;
  arguments.run.progress = [&progress](const mission::Progress& now) { show(now, progress); };
  arguments.run.warn = [](const std::string& warning) { std::cerr << "tutti: warning: " << warning << '\n'; };
  arguments.run.stop = announced_stop("report and map of what is there are made");
  const auto record = lab::run_mission(*config, arguments.run);
  progress.close();
  if (!record) {
    const bool wants_data = record.error().code == ErrorCode::io && arguments.run.data.empty();
    return failed(record.error().message +
                  (wants_data
                       ? "\ntutti: the mission's files are looked for in this folder; --data FOLDER says where they are"
                       : ""));
  }
  if (const auto ok = mission::write_report(*record, out); !ok) return failed(ok.error().message);
  std::cout << mission::report_text(*record, (arguments.out / "report.html").string());
  return 0;
}

constexpr int kPagePort = 8080;
constexpr double kLiveRate = 4.0;

int show_live(const MissionArguments& arguments, const std::string& sensors, int port) {
  constexpr const char* kLive = "demo --live";
  if (sensors != "lidar" || !arguments.map.empty())
    return complain(kLive, "shows the robots with LiDAR, and keeps its map in OUT/state: without --sensors and --map",
                    2);
  lab::MissionUpOptions options{
      .mission = {.file = "demo", .data = {}, .assignments = arguments.assignments, .seed = arguments.run.seed},
      .out = arguments.out,
      .rate = arguments.run.rate.value_or(kLiveRate),
      .view = std::to_string(port)};
  if (options.out.empty()) options.out = fs::path("out") / fmt::format("demo_live_{}", program::wall_clock_ns());
  fmt::print(stderr, "tutti demo: look at http://127.0.0.1:{}/ for the next minutes\n", port);
  program::stop_on_signals();
  const Status shown = run_as_programs(options, program::Level::warning);
  return shown ? 0 : complain(kLive, shown.error().message);
}

struct WorldOptions {
  std::string mission;
  std::string output;
  std::uint64_t seed = 1;
  double points_m = 0.0;
  std::vector<std::string> assignments;
};

int write_world(const WorldOptions& options) {
  const auto config = lab::load_mission(options.mission, options.assignments);
  if (!config) return complain("world", config.error().message, 2);
  if (config->source != "simulation")
    return complain("world", fmt::format("{}: source is '{}', expected 'simulation'", options.mission, config->source),
                    2);
  const auto mesh = simulation::world_mesh(config->simulation, options.seed);
  Status written = make_folder_of(options.output);
  if (written)
    written = options.points_m > 0.0
                  ? formats::write_ply(options.output,
                                       simulation::sample_surface(mesh, options.points_m, Rng(options.seed)).points)
                  : formats::write_ply(options.output, mesh.vertices, {}, mesh.triangles);
  if (!written) return complain("world", written.error().message);
  fmt::print("{}: {} triangles, world of {} with seed {}\n", options.output, mesh.triangles.size(), config->mission,
             options.seed);
  return 0;
}

}  // namespace

void add_demo_command(CLI::App& app, int& exit_code) {
  const std::map<std::string, lab::DemoSensors> names{
      {"lidar", lab::DemoSensors::lidar}, {"visual", lab::DemoSensors::visual}, {"both", lab::DemoSensors::both}};
  auto arguments = std::make_shared<MissionArguments>();
  const auto sensors = std::make_shared<std::string>("lidar");
  CLI::App* command =
      app.add_subcommand("demo",
                         "See it work without any data: simulated robots with drifting odometry map one place; loop\n"
                         "closures are found from what they see. Takes about a minute and ends with a table and a\n"
                         "report to look at.");
  command
      ->add_option("--sensors", *sensors,
                   "lidar: two legged robots with LiDAR walk six minutes through a piece of tunnel.\n"
                   "visual: three robots with a camera fly a minute through one hall; bundle adjustment\n"
                   "refines their map.\n"
                   "both: one with LiDAR, one with a camera and one with both fly there")
      ->check(CLI::IsMember(std::vector<std::string>{"lidar", "visual", "both"}))
      ->type_name("S")
      ->capture_default_str();
  const auto live = std::make_shared<std::optional<int>>();
  command
      ->add_option_function<std::string>(
          "--live", [live](const std::string& port) { live->emplace(port.empty() ? kPagePort : std::stoi(port)); },
          fmt::format("Watch it: the same robots as programs of their own, four times as fast as they walk, and their "
                      "map on a\npage at this port of this machine, {} unless stated otherwise",
                      kPagePort))
      ->expected(0, 1)
      ->check(CLI::Range(1, 65535) | CLI::IsMember(std::vector<std::string>{""}))
      ->type_name("[PORT]");
  add_mission_options(*command, *arguments);
  command->callback([=, &exit_code] {
    if (live->has_value()) {
      exit_code = show_live(*arguments, *sensors, **live);
      return;
    }
    const auto config = lab::demo_mission(arguments->assignments, names.at(*sensors));
    if (arguments->out.empty() && config) arguments->out = fs::path("out") / config->mission;
    exit_code = run_and_report(config, *arguments);
  });
}

void add_run_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<MissionArguments>();
  CLI::App* command = app.add_subcommand(
      "run",
      "Run a mission: replay (or simulate) its robots, merge their maps on the server, send proxy graphs back,\n"
      "correct the robots, and write a report (report.html, report.json, trajectories, graph, map).\n"
      "The same mission, data and seed give the same report.json.");
  const auto bags = std::make_shared<std::vector<std::string>>(), topics = std::make_shared<std::vector<std::string>>();
  const auto inputs = std::make_shared<std::vector<std::string>>();
  auto* mission = command
                      ->add_option("mission", *inputs,
                                   "Mission file, or 'demo'; or bags, one a robot, or a folder of such: robots are "
                                   "called as the files")
                      ->type_name("MISSION.yaml|BAG...");
  auto* bag =
      command
          ->add_option(
              "--bag", *bags,
              "Instead of a mission file: a robot and what it recorded, a folder of rosbag2's, .mcap, .db3 or .bag;\n"
              "several times, e.g. --bag alpha=recordings/a --bag bravo=recordings/b. Topics are found by type")
          ->type_name("NAME=BAG")
          ->excludes(mission);
  const auto graph = std::make_shared<std::string>();
  command
      ->add_option(
          "--graph", *graph,
          "Instead of a mission file: a pose graph of several robots, PyFG, JRL or g2o (where it has no times, the "
          "n-th pose of a\nrobot is at n seconds). Robots are called by their letters; closures come when "
          "they arrived then,\nand vertices of PyFG and JRL are the reference")
      ->type_name("FLEET.pyfg")
      ->excludes(mission)
      ->excludes(bag);
  command
      ->add_option("--topic", *topics,
                   "Of a bag where several topics would do: --topic alpha.scans=/points,\n"
                   "--topic alpha.odometry=/odom, or two frames of /tf: --topic 'alpha.odometry=odom->base_link'.\n"
                   "KIND is odometry, scans, images, depth (of the one camera; none: no depth), imu or fixes")
      ->type_name("NAME.KIND=TOPIC");
  command->add_option("--data", arguments->run.data, "Folder that the mission's file names are relative to")
      ->type_name("DIR");
  auto* map_in =
      command->add_option("--map-in", arguments->map_in, "A map's file to localise the robots in")->type_name("MAP");
  command
      ->add_flag(
          "--frozen", arguments->frozen,
          "With --map-in: no pose of the map moves. The mission's robots find their places in it, each alone and\n"
          "without a start pose, and follow the map; OUT/localise.json, NAME_localised.tum and NAME_states.csv say\n"
          "where they were and when they did not know")
      ->needs(map_in);
  command
      ->add_flag("--extend", arguments->extend,
                 "With --map-in: no pose of the map moves, and the mission's robots add to it what they see of new\n"
                 "ground; --map says where the map with it goes")
      ->needs(map_in)
      ->excludes("--frozen");
  add_number(*command, "--restart-every", arguments->trial.restart_s,
             "With --frozen: robots forget where they are so often, to see how they find their places; 0: never", "S",
             within(0.0, 1e6))
      ->needs("--frozen");
  add_number(*command, "--kidnap-every", arguments->trial.kidnap_s,
             "With --frozen: robots with LiDAR are carried so often to where they would be 20 s later, and their\n"
             "odometry does not notice; 0: never",
             "S", within(0.0, 1e6))
      ->needs("--frozen")
      ->excludes("--restart-every");
  command
      ->add_flag(
          "--lift", arguments->trial.lift,
          "With --frozen: each robot with LiDAR drives half of its way, takes a lift for 20 s, which its odometry\n"
          "does not notice, and drives the second half of the next robot's way, of the first's after the last's")
      ->needs("--frozen")
      ->excludes("--restart-every")
      ->excludes("--kidnap-every");
  command
      ->add_flag("--true-start", arguments->trial.true_start,
                 "With --frozen: each robot is given its true start pose, by its reference; scans have to confirm it")
      ->needs("--frozen");
  add_mission_options(*command, *arguments);
  command->callback([arguments, inputs, bags, topics, graph, &exit_code] {
    const auto run_text = [&](const fs::path& name, const char* option, const Result<std::string>& text) {
      if (arguments->out.empty()) arguments->out = fs::path("out") / name;
      exit_code = run_and_report(
          text ? lab::parse_mission(*text, option, arguments->assignments) : tl::unexpected(text.error()), *arguments);
    };
    if (!inputs->empty() && !mission::is_mission_file(inputs->front())) {
      const auto named = mission::name_bags(*inputs, arguments->run.data);
      return run_text("bags", "run", named ? mission::bag_mission(*named, *topics) : tl::unexpected(named.error()));
    }
    if (inputs->size() > 1) throw CLI::ValidationError("mission", "expected one mission file, or bags");
    if (!inputs->empty()) arguments->mission = inputs->front();
    if (!bags->empty()) return run_text("bags", "--bag", mission::bag_mission(*bags, *topics));
    if (!topics->empty()) throw CLI::RequiredError("--topic requires --bag");
    if (!graph->empty())
      return run_text(fs::path(*graph).stem(), "--graph", mission::graph_mission(*graph, arguments->run.data));
    if (arguments->mission.empty())
      throw CLI::RequiredError("MISSION.yaml, BAG.., --bag NAME=BAG or --graph FLEET.pyfg");
    if (arguments->out.empty()) arguments->out = fs::path("out") / arguments->mission.stem();
    exit_code = run_and_report(lab::load_mission(arguments->mission, arguments->assignments), *arguments);
  });
}

void add_world_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<WorldOptions>();
  auto* command =
      app.add_subcommand("world", "Write the world of a simulated mission as a PLY file, to look at or to survey.");
  command->footer(
      "The very walls that the simulated LiDAR sees with the same seed, in the frame of the reference trajectories.\n"
      "Example: tutti world missions/tunnel.yaml -o tunnel.ply\n");
  command->add_option("mission", options->mission, "Mission file with source: simulation, or 'demo'.")
      ->required()
      ->type_name("MISSION.yaml");
  command->add_option("-o,--output", options->output, "Where to write it.")->required()->type_name("OUT.ply");
  command->add_option("--seed", options->seed, "As for tutti run.")->check(whole_number())->capture_default_str();
  command->add_option("--points", options->points_m, "Points about this far apart instead of a mesh, in metres.")
      ->check(within(1e-3, 1e3));
  command->add_option("--set", options->assignments, "Change a setting of the mission: key=value.")
      ->type_name("KEY=VALUE");
  command->callback([options, &exit_code] { exit_code = write_world(*options); });
}

}  // namespace tutti::app
