// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/lab/mission_up.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "tutti/base/file.hpp"
#include "tutti/bus/transport.hpp"
#include "tutti/lab/children.hpp"
#include "tutti/lab/collect_mission.hpp"
#include "tutti/mission/load_meter.hpp"
#include "tutti/pki/pki.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::lab {
namespace {

namespace fs = std::filesystem;
using SteadyClock = std::chrono::steady_clock;

constexpr auto kPollEvery = std::chrono::milliseconds(200);
constexpr auto kServerStarts = std::chrono::seconds(120);
constexpr const char* kWatcher = "watcher";  // this program, on a bus with rights

std::string worker_name(int number) { return fmt::format("worker{}", number + 1); }

/// The server knows all that is to be known of the robots' submaps, and every robot has heard it: a robot reports that
/// it has finished and that everything is stored only after it was.
bool is_over(const MissionStatus& status, const std::vector<std::string>& names) {
  if (status.has_news || status.pending_jobs > 0) return false;
  return std::ranges::all_of(names, [&](const std::string& name) {
    const auto robot = std::ranges::find(status.robots, name, [](const auto& r) { return r.status.name; });
    if (robot == status.robots.end() || !robot->status.finished || robot->status.backlog_submaps > 0) return false;
    return robot->status.heard_epoch == status.epoch && robot->status.heard_revision == status.revision;
  });
}

class MissionUp {
 public:
  MissionUp(const MissionUpOptions& options, MissionConfig config)
      : options_(options), config_(std::move(config)), names_(robot_names(config_)), state_(options.out / "state") {}
  Status start(const std::atomic<bool>& stop);
  Status watch(const std::atomic<bool>& stop);
  void end();
  Result<mission::MissionRecord> collect() const;

 private:
  /// `member`: whose credential it gets, if the bus has rights; empty: nobody's.
  [[nodiscard]] std::vector<std::string> command_line(const std::string& command, const std::string& member,
                                                      const fs::path& folder) const;
  Status make_credentials();
  Status start_server(const std::atomic<bool>& stop);
  void report(const MissionStatus& status) const;

  const MissionUpOptions& options_;
  MissionConfig config_;
  std::vector<std::string> names_;
  std::string name_;  // on the bus
  fs::path state_;
  Children children_;
  std::string bus_;
  std::optional<pki::Pki> pki_;  // of a bus with rights
  SteadyClock::time_point begin_ = SteadyClock::now();
  double wall_s_ = 0.0;
  Timestamp newest_;                     // of the server's statuses
  std::optional<Timestamp> stopped_at_;  // by a signal, before the mission was over
};

/// The command line that all programs get.
std::vector<std::string> MissionUp::command_line(const std::string& command, const std::string& member,
                                                 const fs::path& folder) const {
  const MissionSource& mission = options_.mission;
  std::vector<std::string> out{options_.program.string(), command, mission.file, "--seed",
                               std::to_string(mission.seed)};
  const auto add = [&](std::initializer_list<std::string> more) { out.insert(out.end(), more); };
  if (!mission.data.empty()) add({"--data", mission.data.string()});
  for (const std::string& assignment : mission.assignments) add({"--set", assignment});
  if (!folder.empty()) add({"--state", folder.string()});
  if (command != "worker") add({"--rate", fmt::format("{}", options_.rate)});
  if (!bus_.empty()) add({"--bus", bus_});
  add({"--mission", name_});
  if (pki_ && !member.empty()) add({"--credentials", pki_->credential(member).string()});
  add({"--end-with-parent", std::to_string(getpid())});
  return out;
}

Status MissionUp::make_credentials() {
  if (!options_.has_rights) return {};
  auto made = pki::Pki::make(state_ / "pki", name_);
  if (!made) return tl::unexpected(made.error());
  pki_ = std::move(*made);
  const auto add = [&](bus::BusRole role, const std::string& name, std::optional<std::uint32_t> number) -> Status {
    if (const auto added = pki_->add(role, name, number); !added) return tl::unexpected(added.error());
    return {};
  };
  for (std::uint32_t i = 0; i < names_.size(); ++i)
    if (Status added = add(bus::BusRole::robot, names_[i], i); !added) return added;
  for (int i = 0; i < options_.workers; ++i)
    if (Status added = add(bus::BusRole::worker, worker_name(i), {}); !added) return added;
  return add(bus::BusRole::views, kWatcher, {});
}

Status MissionUp::start_server(const std::atomic<bool>& stop) {
  std::error_code error;
  if (fs::exists(state_, error))
    return fail(ErrorCode::io, "{}: there is one of an earlier mission; another --out is needed, or remove it",
                state_.string());
  fs::create_directories(state_, error);
  if (error) return fail(ErrorCode::io, "{}: cannot be made: {}", state_.string(), error.message());
  if (Status made = make_credentials(); !made) return made;
  auto server = command_line("server", "", state_ / "server");
  if (pki_) server.insert(server.end(), {"--pki", (state_ / "pki").string()});
  server.insert(server.end(), {"--threads", std::to_string(options_.workers > 0 ? 0 : options_.threads)});
  if (!options_.view.empty()) server.insert(server.end(), {"--view", options_.view});
  const fs::path output = state_ / "server.out";
  if (Status started = children_.start("server", server, output); !started) return started;
  const auto until = SteadyClock::now() + kServerStarts;
  while (bus_.empty()) {
    if (Status runs = children_.check(); !runs) return runs;
    if (stop) return fail(ErrorCode::io, "stopped");
    if (SteadyClock::now() > until) return fail(ErrorCode::io, "the server does not start: {}", output.string());
    const std::string text = read_file(output.string()).value_or("");
    const std::size_t begin = text.find("--bus ");
    const std::size_t end = text.find(' ', begin == std::string::npos ? begin : begin + 6);
    if (begin != std::string::npos && end != std::string::npos) bus_ = text.substr(begin + 6, end - begin - 6);
    std::this_thread::sleep_for(kPollEvery / 10);
  }
  return {};
}

Status MissionUp::start(const std::atomic<bool>& stop) {
  auto on_bus = name_on_bus(options_.mission, config_);
  if (!on_bus) return tl::unexpected(on_bus.error());
  name_ = std::move(*on_bus);
  if (Status started = start_server(stop); !started) return started;
  for (int i = 0; i < options_.workers; ++i) {
    const std::string name = worker_name(i);
    auto worker = command_line("worker", name, {});
    worker.insert(worker.end(), {"--threads", std::to_string(options_.threads)});
    if (Status started = children_.start(name, worker, state_ / (name + ".out")); !started) return started;
  }
  for (const std::string& name : names_) {
    auto robot = command_line("robot", name, state_ / "robots" / name);
    robot.insert(robot.end(), {"--name", name, "--stay", "--session", "0"});
    if (Status started = children_.start("robot " + name, robot, state_ / (name + ".out")); !started) return started;
  }
  return {};
}

Status MissionUp::watch(const std::atomic<bool>& stop) {
  bus::BusOptions on_bus{.url = bus_, .mission = name_};
  const auto watcher = bus::Endpoint::viewer(static_cast<std::uint32_t>(getpid()));
  if (pki_) {
    auto credentials = bus::read_credentials(pki_->credential(kWatcher).string());
    if (!credentials) return tl::unexpected(credentials.error());
    on_bus.credentials = std::move(*credentials);
  }
  const auto port = bus::open_port(watcher, on_bus);
  if (!port) return tl::unexpected(port.error());
  while (true) {
    for (const bus::Received& message : (*port)->receive()) {
      const auto status = wire::decode_mission_status(*message.envelope.bytes);
      if (!status) return tl::unexpected(status.error());
      newest_ = status->time;
      report(*status);
      if (is_over(*status, names_)) return {};
    }
    if (Status runs = children_.check(); !runs) return runs;
    if (stop) {
      stopped_at_ = newest_;
      if (options_.progress) options_.progress("stopping: the report of what is there is made; once more ends at once");
      return {};
    }
    std::this_thread::sleep_for(kPollEvery);
  }
}

void MissionUp::report(const MissionStatus& status) const {
  if (!options_.progress) return;
  std::uint64_t backlog = 0;
  for (const MissionStatus::Robot& robot : status.robots) backlog += robot.status.backlog_submaps;
  const auto finished = std::ranges::count_if(status.robots, [](const auto& robot) { return robot.status.finished; });
  options_.progress(
      fmt::format("{:.0f} s   {} of {} robots have finished; {} submaps, {} on their way, {} jobs open, {} "
                  "closures, {} maps",
                  status.time - Timestamp{}, finished, names_.size(), status.submaps, backlog, status.pending_jobs,
                  status.closures, status.components));
}

/// The server last: it still takes what the others send.
void MissionUp::end() {
  wall_s_ = std::chrono::duration<double>(SteadyClock::now() - begin_).count();
  std::vector<std::string> others;
  for (const std::string& name : names_) others.push_back("robot " + name);
  for (int i = 0; i < options_.workers; ++i) others.push_back(worker_name(i));
  children_.stop(others);
  children_.stop_all();
}

Result<mission::MissionRecord> MissionUp::collect() const {
  auto record = collect_mission(config_, options_.mission, state_, options_.version);
  if (!record) return record;
  record->notes.push_back(
      fmt::format("Run as {} programs on one machine, which talked over NATS{}, at {:g} times real time.",
                  1 + names_.size() + static_cast<std::size_t>(options_.workers),
                  options_.has_rights ? " with TLS and rights" : "", options_.rate));
  if (stopped_at_)
    record->notes.push_back(
        fmt::format("stopped at {:.0f} s, before the mission was over: the report is of what is there",
                    *stopped_at_ - Timestamp{}));
  record->timing.machine = mission::machine_description();
  record->timing.wall_s = wall_s_;
  record->timing.rate = options_.rate;
  return record;
}

}  // namespace

Result<mission::MissionRecord> mission_up(const MissionUpOptions& options, const std::atomic<bool>& stop) {
  auto config = load(options.mission);
  if (!config) return tl::unexpected(config.error());
  MissionUp mission(options, std::move(*config));
  if (Status started = mission.start(stop); !started) return tl::unexpected(started.error());
  const Status watched = mission.watch(stop);
  mission.end();
  if (!watched) return tl::unexpected(watched.error());
  return mission.collect();
}

}  // namespace tutti::lab
