// SPDX-License-Identifier: BSD-3-Clause
// The programs that talk over a bus: server, robot, worker, and all of them at once: mission up.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>

#include "bus_options.hpp"
#include "commands.hpp"
#include "options.hpp"
#include "program_options.hpp"
#include "ros_commands.hpp"
#include "tutti/program/page/page_program.hpp"
#include "tutti/program/robot_program.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/program/stop.hpp"
#include "tutti/program/worker_program.hpp"

namespace tutti::app {
namespace {

constexpr const char* kFilesName = "as the mission file says (mission: NAME), else 'tutti'";

void add_state_option(CLI::App& command, std::filesystem::path& state, const std::string& what) {
  command.add_option("--state", state, what)->type_name("DIR")->required();
}

/// With the mission of the server.
program::PageChildOptions page_of(const std::string& listen, const ProgramArguments& common) {
  const lab::MissionSource& mission = common.mission;
  program::PageChildOptions out{.listen = listen,
                                .arguments = {"--log-level", common.log_level, "--seed", std::to_string(mission.seed)}};
  if (!mission.data.empty()) out.arguments.insert(out.arguments.end(), {"--data", mission.data});
  for (const std::string& assignment : mission.assignments)
    out.arguments.insert(out.arguments.end(), {"--set", assignment});
  if (!mission.file.empty()) out.arguments.push_back(mission.file);
  return out;
}

}  // namespace

void add_server_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<program::ServerOptions>();
  const auto common = std::make_shared<ProgramArguments>();
  options->version = TUTTI_VERSION;
  CLI::App* command = app.add_subcommand(
      "server",
      "The mapping server: merges the maps of all robots of its bus into one file, STATE/map.tutti, and sends each "
      "robot\n"
      "what it needs. Without --bus it starts a nats-server of its own. Prints one line: the command that starts a "
      "robot.\n"
      "Killed at any moment and started again with the same --state it goes on; SIGTERM or Ctrl-C stop it.");
  add_state_option(
      *command, options->state,
      "Folder of this server: map, log, events, bus; made if missing. In a new one a map.tutti from elsewhere goes "
      "on");
  CLI::Option* const held =
      command
          ->add_option("--map", options->held_map,
                       "With --frozen, where STATE has no map yet: the map's file to begin with, which is not changed")
          ->type_name("MAP");
  CLI::Option* const frozen =
      command->add_flag("--frozen")
          ->description(
              "No pose of MAP moves, to the bit: robots are laid into it and beside each other, and what they "
              "see of new ground grows\nbeside it in STATE/map.tutti (docs/localise.md)")
          ->needs(held);
  held->needs(frozen);
  add_bus_options(*command, options->bus, "A bus that runs already",
                  "Let other machines in without --pki: whoever reaches the port can write to the map");
  command
      ->add_option("--listen", options->listen,
                   "Where the server's own bus is to be reached; default: from this machine only, the port of the last "
                   "time, else any from 20000 on")
      ->type_name("HOST[:PORT]");
  command
      ->add_option(
          "--pki", options->pki,
          "The folder of `tutti pki`: TLS and rights for the server's own bus, which other machines can then use")
      ->type_name("DIR");
  add_mission_argument(*command, *common, "Names of the robots and all settings; without it any robot is welcome");
  add_mission_name(*command, common->mission.name, kFilesName);
  command->add_option("--threads", options->threads, "Threads that verify loop closures here; 0 = only workers do")
      ->type_name("N")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  add_rate_option(*command, options->rate,
                  "How fast mission time passes, for robots that replay faster than real time");
  const auto view = std::make_shared<std::string>();
  command
      ->add_option("--view", *view,
                   "Serve the page of the mission (map, robots, closures, alerts, decisions) at this port of this "
                   "machine, by a program of its own (tutti page); with a HOST to others, too, which needs --pki "
                   "(docs/operating.md)")
      ->type_name("[HOST:]PORT");
  const auto ros = add_ros_server_options(*command);
  add_program_options(*command, *common);
  options->announce = [](const std::string& line) {
    fmt::print("{}\n", line);
    std::fflush(stdout);
  };
  command->callback([options, common, view, ros, &exit_code] {
    exit_code = run_program("server", *common, options->console, [&]() -> Status {
      auto settings = lab::server_settings(common->mission);
      if (!settings) return tl::unexpected(settings.error());
      if (common->print_config) return print_settings(*settings);
      if (wants_ros(*ros))
        if (Status shown = show_on_ros(*ros, *options); !shown) return shown;
      options->settings = std::move(*settings);
      if (!view->empty()) options->page = page_of(*view, *common);
      return program::run_server(*options, program::stop_asked());
    });
  });
}

void add_robot_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<program::RobotOptions>();
  const auto common = std::make_shared<ProgramArguments>();
  options->version = TUTTI_VERSION;
  CLI::App* command = app.add_subcommand(
      "robot",
      "One robot: takes odometry, scans and images from a live feed, or replays its recording in a mission, sends "
      "submaps to "
      "the\n"
      "server and corrects itself by what the server sends back. Needs no link: what the server has not stored waits "
      "in\n"
      "STATE. Killed at any moment and started again with the same --state it goes on where it stood. Ends when the\n"
      "recording has and the server has everything.");
  command->add_option("--name", options->name, "Its name in the mission; with --feed any, another for each robot")
      ->type_name("NAME")
      ->required();
  CLI::Option* const bus = add_bus_options(*command, options->bus);
  const auto map = std::make_shared<std::filesystem::path>();
  const auto localise = std::make_shared<bool>(false);
  CLI::Option* const map_option =
      command->add_option("--map", *map, "The map's file that --localise is about")->type_name("MAP");
  CLI::Option* const localise_option = command->add_flag(
      "--localise", *localise,
      "Find its place in MAP, which does not move, and follow it there; without --map in the map that is\n"
      "published to its mission (tutti map publish); without --bus alone, and nothing is kept for a server.\n"
      "Its state is in STATE/status.json, its poses are answered as ever (docs/localise.md)");
  map_option->needs(localise_option);
  add_state_option(*command, options->state,
                   "Folder of this robot: what it knows, and what is not sent yet; made if missing");
  add_mission_argument(*command, *common,
                       "The mission whose recording is replayed, or 'demo'; with --feed: only names and settings");
  add_mission_name(*command, common->mission.name, kFilesName);
  command
      ->add_option("--feed", options->feed,
                   "Take odometry, scans, images and IMU on this Unix socket and answer with where the robot is "
                   "(docs/protocol.md)")
      ->type_name("SOCKET");
  command
      ->add_option("--feed-group", options->feed_access.group,
                   "The group that the socket of --feed belongs to; default: this program's")
      ->type_name("GROUP");
  command
      ->add_option_function<std::string>(
          "--feed-mode",
          [options](const std::string& mode) {
            options->feed_access.mode = static_cast<unsigned>(std::stoul(mode, nullptr, 8));
          },
          "Who may connect to it, as of chmod: 0600 (default) this user, 0660 the group too")
      ->check([](const std::string& mode) {
        const bool is_mode = !mode.empty() && mode.size() <= 4 &&
                             mode.find_first_not_of("01234567") == std::string::npos &&
                             std::stoul(mode, nullptr, 8) <= 0777;
        return is_mode ? std::string() : "expected an octal mode such as 0660, got '" + mode + "'";
      })
      ->type_name("MODE");
  add_number(*command, "--uplink-budget", options->uplink_bytes_per_s,
             "What its submaps may take of the link, the newest first; 0 = no limit", "BYTES_PER_S", within(0.0, 1e12));
  command
      ->add_option("--archive", options->max_archive_bytes,
                   "Of submaps that the server has, so many are kept in STATE, the newest, in case its map loses them")
      ->type_name("BYTES")
      ->check(whole_number())
      ->capture_default_str();
  add_rate_option(*command, options->rate, "Times real time: the recording; with --feed, mission time");
  command->add_flag("--stay", options->stay, "Go on listening after the recording, until SIGTERM");
  command->add_option("--session", options->session, "Number of its session; default: when STATE was made")
      ->check(whole_number())
      ->group("");
  const auto ros = add_ros_robot_options(*command);
  add_program_options(*command, *common);
  command->callback([options, common, ros, bus, map, localise, &exit_code] {
    options->is_alone = bus->count() == 0;
    if (options->is_alone && map->empty() && !common->print_config)
      throw CLI::RequiredError(*localise ? "--map or --bus" : "--bus");
    if (options->is_alone) options->bus.url = "memory://" + options->name;
    if (common->print_config) {
      exit_code = run_program("robot", *common, options->console, [&]() -> Status {
        const auto settings = lab::robot_settings(common->mission);
        return settings ? print_settings(*settings) : Status(tl::unexpected(settings.error()));
      });
      return;
    }
    if (wants_ros(*ros) && options->feed.empty()) options->feed = (options->state / "feed").string();
    if (options->feed.empty() && common->mission.file.empty()) {
      exit_code = complain("robot", "expected a mission, whose recording is replayed, --feed SOCKET or --ros", 2);
      return;
    }
    exit_code = run_program("robot", *common, options->console, [&]() -> Status {
      if (Status ok = lab::fill_robot_options(common->mission, *options); !ok) return ok;
      if (*localise && map->empty())
        options->open_map = [common](const std::filesystem::path& file) {
          return lab::localise_setup(common->mission, file);
        };
      if (!map->empty()) {
        auto setup = lab::localise_setup(common->mission, *map);
        if (!setup) return tl::unexpected(setup.error());
        options->localise = std::move(*setup);
      }
      if (wants_ros(*ros))
        if (Status ok = feed_from_ros(*ros, *options); !ok) return ok;
      return program::run_robot(*options, program::stop_asked());
    });
  });
}

void add_page_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<page::PageProgramOptions>();
  const auto common = std::make_shared<ProgramArguments>();
  options->page.version = TUTTI_VERSION;
  CLI::App* command = app.add_subcommand("page",
                                         "Serves the page of a running mission (docs/page.md), beside its server, "
                                         "whose map it reads. `tutti server --view` "
                                         "starts\n"
                                         "it. It remembers what it has shown: killed at any moment and started again "
                                         "with the same --state it goes on, and\n"
                                         "the mission does not notice. SIGTERM or Ctrl-C stop it.");
  add_bus_options(*command, options->bus)->required();
  command->add_option("--server", options->server, "The state folder of the server, on this machine")
      ->type_name("DIR")
      ->required();
  command
      ->add_option("--listen", options->page.listen,
                   "Where browsers reach it: a port of this machine; with a HOST others do, too, which needs --pki")
      ->type_name("[HOST:]PORT")
      ->required();
  command->add_option("--state", options->state, "Folder of this page: what it has shown, log; default: SERVER/page")
      ->type_name("DIR");
  command
      ->add_option(
          "--pki", options->page.pki,
          "The folder of `tutti pki`: TLS, and who may see the page and decide there. --credentials is then that "
          "of an operator called 'page', for whom those who decide are named")
      ->type_name("DIR");
  add_mission_argument(*command, *common, "Needed only where closures come from its reference");
  add_mission_name(*command, common->mission.name, kServedMission);
  add_rate_option(*command, options->page.rate, "How fast mission time passes, as the server has it");
  add_program_options(*command, *common);
  command->callback([options, common, &exit_code] {
    exit_code = run_program("page", *common, options->console, [&]() -> Status {
      auto settings = lab::worker_settings(common->mission);
      if (!settings) return tl::unexpected(settings.error());
      if (common->print_config) return print_settings(*settings);
      options->verifiers = std::move(settings->verifiers);
      options->bus.mission = settings->mission;
      options->page.allow_insecure = options->bus.allow_insecure;
      options->page.announce = [](const std::string& url) {
        fmt::print(stderr, "tutti page: the page is at {}\n", url);
      };
      if (options->state.empty()) options->state = options->server / "page";
      return page::run_page(*options, program::stop_asked());
    });
  });
}

void add_worker_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<program::WorkerOptions>();
  const auto common = std::make_shared<ProgramArguments>();
  options->version = TUTTI_VERSION;
  CLI::App* command = app.add_subcommand(
      "worker",
      "Verifies loop closures for the server of a bus: any number of them, on any machine, come and go as they like.\n"
      "Keeps nothing: killed in the middle of a job it costs time only, the job goes to another. SIGTERM or Ctrl-C "
      "stop "
      "it.");
  add_bus_options(*command, options->bus)->required();
  add_mission_argument(*command, *common,
                       "Needed only where closures come from its reference: all else the server says with each job");
  add_mission_name(*command, common->mission.name, kServedMission);
  command->add_option("--threads", options->threads, "Pairs that are verified at a time; 0 = one on each core")
      ->type_name("N")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  add_program_options(*command, *common);
  command->callback([options, common, &exit_code] {
    exit_code = run_program("worker", *common, options->console, [&]() -> Status {
      auto settings = lab::worker_settings(common->mission);
      if (!settings) return tl::unexpected(settings.error());
      if (common->print_config) return print_settings(*settings);
      options->settings = std::move(*settings);
      return program::run_worker(*options, program::stop_asked());
    });
  });
}

}  // namespace tutti::app
