// SPDX-License-Identifier: BSD-3-Clause
// tutti map publish: robots of a mission get a map to localise in.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <utility>

#include "bus_options.hpp"
#include "map_command.hpp"
#include "options.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/mapfile/known_map.hpp"
#include "tutti/program/clock.hpp"
#include "tutti/publishing/publication.hpp"

namespace tutti::app {
namespace {

constexpr const char* kPublish = "map publish";

struct PublishOptions {
  std::string map;
  bool revert = false;
  bus::BusOptions bus{.url = {}, .mission = {}};
};

void say_looking(const std::string& what) { fmt::print(stderr, "tutti {}: {}\n", kPublish, what); }

Result<publishing::Publication> publish_file(const PublishOptions& options, bus::MapBoard& board, std::int64_t now_ns) {
  const auto bytes = mapfile::read_copy(options.map);
  if (!bytes) return tl::unexpected(bytes.error());
  const auto opened = mapfile::open_known_map(options.map);
  if (!opened) return tl::unexpected(opened.error());
  auto done = publishing::publish(board, *bytes, {.map = opened->known->id, .version = opened->known->revision},
                                  options.bus.credentials, now_ns);
  return done ? std::move(done) : in_context(options.map, done.error());
}

int publish(const PublishOptions& options) {
  if (options.revert != options.map.empty())
    return complain(kPublish, "expected a map's file, or --revert to publish again the map before this one", 2);
  bus::BusOptions where = options.bus;
  auto mission = bus::served_mission(where, bus::kLookForServer_s, say_looking);
  if (!mission) return complain(kPublish, mission.error().message, 2);
  where.mission = std::move(*mission);
  const auto board = bus::open_maps(where);
  if (!board) return complain(kPublish, board.error().message, 2);
  const auto now_ns = static_cast<std::int64_t>(program::wall_clock_ns());
  const auto done = options.revert ? publishing::publish_older(**board, where.credentials, now_ns)
                                   : publish_file(options, **board, now_ns);
  if (!done) return complain(kPublish, done.error().message, done.error().code == ErrorCode::configuration ? 2 : 1);
  const auto& known = where.credentials.known;
  fmt::print(
      "mission '{}': version {} of map {} is published, {} bytes in {} pieces, SHA-256 {}\n"
      "{}; robots with --localise and without --map fetch it, and change to it when they stand\n",
      where.mission, done->version, done->map, done->bytes, done->pieces(), done->hash,
      known ? "signed by " + to_string(*known) : "signed by nobody, as this bus knows no rights");
  return 0;
}

}  // namespace

void add_map_publish_command(CLI::App& map, int& exit_code) {
  const auto options = std::make_shared<PublishOptions>();
  CLI::App* command = map.add_subcommand(
      "publish", "Give the robots of a mission a map to localise in: they fetch it over the bus, piece by piece.");
  command->footer(
      "Robots started with --localise and without --map fetch it, keep it and the one before, and change to it when "
      "they stand (docs/localise.md).\nOn a bus with rights operators alone may, and robots believe no other "
      "signature.\nExample: tutti map publish site.tutti --bus tls://BASE:4222 --credentials anna.cred\n");
  command->add_option("map", options->map, "The map's file; also one that a server has open.")->type_name("MAP");
  command->add_flag("--revert", options->revert,
                    "Instead of a file: publish again the map that was published before this one");
  add_bus_options(*command, options->bus)->required();
  add_mission_name(*command, options->bus.mission, kServedMission);
  command->callback([options, &exit_code] { exit_code = publish(*options); });
}

}  // namespace tutti::app
