// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bus_options.hpp"
#include "commands.hpp"
#include "options.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/bus/nats_child.hpp"
#include "tutti/node/status_text.hpp"
#include "tutti/program/field_json.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::app {
namespace {

using Json = FieldJson;
using Clock = std::chrono::steady_clock;

constexpr double kFresh_s = 6.0;  // three of the server's periods: it is there

struct StatusOptions {
  bus::BusOptions bus{.url = {}, .mission = {}};
  bool json = false;
  bool watch = false;
  double wait_s = 6.0;
};

double since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

/// The server as this viewer has seen it.
class View {
 public:
  /// Whether there is something new.
  bool update(bus::Port& port) {
    bool is_new = false;
    for (const bus::Received& received : port.receive()) {
      auto decoded = wire::decode_mission_status(*received.envelope.bytes);
      if (!decoded) {
        problem_ = decoded.error().message;
        continue;
      }
      status_ = std::move(*decoded);
      ++seen_;
      came_ = Clock::now();
      is_new = true;
    }
    return is_new;
  }
  [[nodiscard]] const std::optional<MissionStatus>& status() const { return status_; }
  [[nodiscard]] const std::string& problem() const { return problem_; }
  /// For how long the server has sent nothing. The first status may be an old one that the bus has kept: its age is by
  /// the wall clocks, until a second one comes.
  [[nodiscard]] double silent_s() const {
    if (!status_) return 0.0;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const double by_wall_s =
        1e-9 *
        static_cast<double>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count() - status_->wall_ns);
    return seen_ > 1 || status_->wall_ns == 0 ? since(came_) : std::max(0.0, by_wall_s);
  }
  /// A server whose clock is another one is there when it is heard twice.
  [[nodiscard]] bool is_there() const {
    return status_ && silent_s() < kFresh_s && (seen_ > 1 || status_->wall_ns != 0);
  }

 private:
  std::optional<MissionStatus> status_;
  std::string problem_;
  std::size_t seen_ = 0;
  Clock::time_point came_;
};

void show(const View& view, const StatusOptions& options) {
  const double silent_s = view.is_there() ? 0.0 : view.silent_s();
  if (options.json) {
    const MissionStatus& status = *view.status();
    Json out{{"server_silent_s", silent_s}, {"time_s", status.time - Timestamp{}}};
    out.update(json_of_fields(status, status.time));
    fmt::print("{}\n", out.dump());
  } else {
    if (options.watch && isatty(STDOUT_FILENO) != 0) fmt::print("\033[H\033[2J");
    fmt::print("{}", node::mission_status_text(*view.status(), silent_s));
  }
  std::fflush(stdout);
}

/// Until something is to be seen, or it is clear that nothing is. The exit code.
int show_once(bus::Port& port, View& view, const StatusOptions& options) {
  bool connected = false;
  for (const auto begin = Clock::now(); since(begin) < options.wait_s && !view.is_there();
       std::this_thread::sleep_for(std::chrono::milliseconds(20))) {
    view.update(port);
    connected = connected || port.state().connected;
  }
  if (view.status()) {
    show(view, options);
    return view.is_there() ? 0 : 1;
  }
  const std::string error = view.problem().empty() ? port.state().last_error : view.problem();
  if (!connected) return complain("status", fmt::format("no link to a bus at {} ({})", options.bus.url, error));
  return complain("status", fmt::format("there is a bus at {}, but no server{} has reported on it{}", options.bus.url,
                                        options.bus.mission.empty() ? "" : " of mission '" + options.bus.mission + "'",
                                        error.empty() ? "" : " (" + error + ")"));
}

int watch(bus::Port& port, View& view, const StatusOptions& options) {
  if (const int code = show_once(port, view, options); code != 0 && !view.status()) return code;
  for (auto shown = Clock::now();; std::this_thread::sleep_for(std::chrono::milliseconds(50))) {
    if (!view.update(port) && since(shown) < kFresh_s) continue;  // of a silent server, how long it is silent
    show(view, options);
    shown = Clock::now();
  }
}

/// The one bus of this machine, for who does not say which.
Result<std::string> bus_here() {
  const std::vector<std::string> found = bus::buses_of_this_machine();
  if (found.size() == 1) return found.front();
  if (found.empty())
    return fail(ErrorCode::invalid,
                "no server of yours runs a bus on this machine; of another machine or user say --bus URL, which the "
                "server prints when it starts");
  return fail(ErrorCode::invalid, "{} servers run a bus on this machine: say --bus {}", found.size(),
              fmt::join(found, " or --bus "));
}

int run(StatusOptions options) {
  if (options.bus.url.empty()) {
    auto found = bus_here();
    if (!found) return complain("status", found.error().message, 2);
    options.bus.url = std::move(*found);
    fmt::print(stderr, "tutti status: --bus {}\n", options.bus.url);
  }
  bus::BusOptions where = options.bus;
  auto mission = bus::served_mission(where, std::min(bus::kLookForServer_s, options.wait_s));
  if (!mission) return complain("status", mission.error().message, 2);
  where.mission = std::move(*mission);
  auto port = bus::open_port(bus::Endpoint::viewer(static_cast<std::uint32_t>(getpid())), where);
  if (!port) return complain("status", port.error().message, 2);
  View view;
  return options.watch ? watch(**port, view, options) : show_once(**port, view, options);
}

}  // namespace

void add_status_command(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<StatusOptions>();
  auto* command = app.add_subcommand(
      "status", "Who is there, and how the mission stands: what the server on this bus says every two seconds.");
  command->footer(
      "Exit codes: 0 the server is there; 1 no bus, or no server (then what it reported last); 2 usage.\n"
      "Without --bus the server on this machine is asked.\n"
      "Example: tutti status --watch\n");
  add_bus_options(*command, options->bus);
  command->add_flag("--json", options->json, "One JSON object on a line instead of a table");
  command->add_flag("--watch", options->watch, "Go on, and show it again whenever something is new");
  add_mission_name(*command, options->bus.mission, kServedMission);
  add_number(*command, "--wait", options->wait_s, "How long to listen for a server at most", "S");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace tutti::app
