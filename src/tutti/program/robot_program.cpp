// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/robot_program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "tutti/bus/mission_lease.hpp"
#include "tutti/bus/nats_port.hpp"
#include "tutti/mission/robot_actor.hpp"
#include "tutti/node/status_envelope.hpp"
#include "tutti/program/host.hpp"
#include "tutti/program/live_feed.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/program/state_folder.hpp"
#include "tutti/program/stop.hpp"
#include "tutti/program/update_json.hpp"
#include "tutti/storage/sqlite_store.hpp"
#include "tutti/wire/message_kind.hpp"

namespace tutti::program {
namespace {

constexpr double kWaitsForMap_s = 60.0;  // after the server has stored everything
constexpr double kLongestWork_s = 0.05;  // then it listens again
constexpr double kStarts_s = 15.0;       // so long a second program of this robot ends when it is told so

class HostedRobot final : public Hosted {
 public:
  HostedRobot(std::unique_ptr<mission::RobotActor> actor, double duration_s, const RobotOptions& options,
              const Clock& clock, const bus::NatsPort& port, EventLog& log, const std::string& alone)
      : actor_(std::move(actor)),
        duration_s_(duration_s),
        options_(options),
        clock_(clock),
        port_(port),
        log_(log),
        alone_(alone),
        begin_s_(clock.wall_s()) {}
  /// Its samples come from clients, not from a recording.
  Status feed_live(Host& host, RobotView view) {
    auto feed = LiveFeed::open(options_.feed, options_.feed_access, *actor_, host, clock_, std::move(view));
    if (!feed) return tl::unexpected(feed.error());
    feed_ = std::move(*feed);
    return {};
  }

  Answer start(Timestamp now) override {
    actor_->resume(now);
    return said();
  }
  Answer receive(const bus::Received& message, Timestamp now) override;
  [[nodiscard]] std::optional<Timestamp> next_work() const override;
  Answer work(Timestamp now) override;
  void wait(double wall_s) override { feed_ ? feed_->serve(wall_s) : Hosted::wait(wall_s); }
  Answer end() override {
    actor_->store_all();
    return said();
  }
  Answer report(Timestamp now) override;
  [[nodiscard]] bool finished() const override;
  [[nodiscard]] Json status(Timestamp now) const override;
  [[nodiscard]] bool is_whole_in_map() const { return actor_->is_whole_in_map(); }
  [[nodiscard]] const mission::RobotActor& actor() const { return *actor_; }
  /// Why this program is not to be: another one is this robot.
  [[nodiscard]] const std::optional<std::string>& refused() const { return refused_; }

 private:
  Answer said(std::vector<std::uint64_t> done = {}) {
    Answer out{actor_->take_step(), std::move(done)};
    if (feed_) feed_->note(out.step);
    return out;
  }
  void note_conflict();
  [[nodiscard]] bool has_ended() const { return feed_ ? feed_->has_ended() : ended_; }
  [[nodiscard]] std::string progress(double time_s) const;

  std::unique_ptr<mission::RobotActor> actor_;
  double duration_s_;
  const RobotOptions& options_;
  const Clock& clock_;
  const bus::NatsPort& port_;
  EventLog& log_;
  const std::string& alone_;  // why it hears no server
  double begin_s_;
  std::unique_ptr<LiveFeed> feed_;  // null: it replays
  bool ended_ = false;              // the recording that it replays
  bool warned_ = false;
  std::optional<std::string> refused_;
  mutable std::optional<double> settled_s_;
};

Answer HostedRobot::receive(const bus::Received& message, Timestamp now) {
  const std::size_t before = actor_->updates().size();
  actor_->receive(message.envelope, now);
  for (std::size_t i = before; i < actor_->updates().size(); ++i) log_.write(to_json(actor_->updates()[i]));
  note_conflict();
  return said({message.ticket});
}

/// Who has just started ends; who maps goes on, whatever others say.
void HostedRobot::note_conflict() {
  const auto& conflict = actor_->node().conflict();
  if (!conflict || warned_) return;
  warned_ = true;
  if (clock_.wall_s() - begin_s_ < kStarts_s)
    refused_ = *conflict;
  else
    log_.say(Level::warning, *conflict + "; this one goes on all the same");
}

std::optional<Timestamp> HostedRobot::next_work() const {
  std::optional<Timestamp> next = actor_->node().next_timer();
  if (feed_ || ended_) return next;
  const double next_s = actor_->next_time();
  const Timestamp sample = next_s > duration_s_ ? Timestamp{} : Timestamp{} + next_s;  // at its end: at once
  return next ? std::min(*next, sample) : sample;
}

/// All samples that are due, as far as they get in a while and within one submap: what the node sends later it reads
/// from its store.
Answer HostedRobot::work(Timestamp now) {
  if (const auto timer = actor_->node().next_timer(); timer && *timer <= now) actor_->on_timer(now);
  const double until_s = clock_.wall_s() + kLongestWork_s;
  const std::size_t backlog = actor_->node().backlog().size();
  while (!feed_ && !ended_ && clock_.wall_s() < until_s && actor_->node().backlog().size() == backlog) {
    const double next_s = actor_->next_time();
    if (next_s > duration_s_) {
      actor_->finish(now);
      ended_ = true;
    } else if (Timestamp{} + next_s <= now) {
      actor_->replay_next(now);
    } else {
      break;
    }
  }
  return said();
}

Answer HostedRobot::report(Timestamp now) {
  NodeStatus status = actor_->node().status(now);
  status.version = options_.version;
  return {{.messages = {node::to_server(bus::Endpoint::of(actor_->id()), std::move(status))}}, {}};
}

bool HostedRobot::finished() const {
  if (refused_) return true;
  if (options_.stay || !has_ended() || !actor_->node().backlog().empty()) {
    settled_s_.reset();
    return false;
  }
  if (!settled_s_) settled_s_ = clock_.wall_s();
  return actor_->is_whole_in_map() || clock_.wall_s() > *settled_s_ + kWaitsForMap_s;
}

std::string HostedRobot::progress(double time_s) const {
  if (!feed_) return fmt::format("{:.0f} of {:.0f} s", std::min(time_s, duration_s_), duration_s_);
  return feed_->has_ended() ? "the recording has ended" : feed_->is_fed() ? "a client feeds" : "no client feeds";
}

Json HostedRobot::status(Timestamp now) const {
  const NodeStatus status = actor_->node().status(now);
  const bus::NatsState link = port_.state();
  const double time_s = now - Timestamp{};
  return {{"program", "robot"},
          {"name", status.name},
          {"time_s", time_s},
          {"finished", has_ended()},
          {"backlog", status.backlog_submaps},
          {"keyframes", status.keyframes},
          {"revision", status.heard_revision},
          {"connected", link.connected},
          {"alone", alone_},
          {"refused", actor_->node().conflict().value_or("")},
          {"line",
           fmt::format("{}, {} keyframes, {} submaps not stored yet, heard map revision {}{}{}", progress(time_s),
                       status.keyframes, status.backlog_submaps, status.heard_revision,
                       link.connected ? "" : ", no link: " + link.last_error, alone_.empty() ? "" : ", " + alone_)}};
}

/// The last event of a program: what only it knows.
Json last_words(const Host::TrafficTable& table, const HostedRobot* robot) {
  Json rows = Json::array();
  for (const auto& [key, traffic] : table)
    rows.push_back({{"sent", key.first},
                    {"kind", wire::name(key.second)},
                    {"messages", traffic.messages},
                    {"bytes", traffic.bytes},
                    {"largest", traffic.largest}});
  Json event{{"event", kEnded}, {"traffic", std::move(rows)}};
  if (robot == nullptr) return event;
  const mission::PolicyTiming timing = robot->actor().timing().front();
  event.update({{"troubles", robot->actor().troubles()},
                {"update_ms", timing.update_ms},
                {"comparison_ms", timing.comparison_ms},
                {"optimisation_ms", timing.optimisation_ms}});
  return event;
}

/// What a status may carry, and a unit of systemd, a folder and a subject of the bus can be called.
Status check_robot_name(const std::string& name) {
  constexpr std::size_t kLongest = 64;
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  const auto wrong = std::ranges::find_if_not(name, is_allowed);
  if (!name.empty() && name.size() <= kLongest && wrong == name.end()) return {};
  const std::string what =
      wrong == name.end() ? fmt::format("{} letters", name.size()) : fmt::format("'{}' is none of these", *wrong);
  return fail(ErrorCode::configuration,
              "--name '{}': {}; a robot is known on the bus by 1 to {} letters, digits, '_' and '-'", name, what,
              kLongest);
}

/// Only a robot that is not replayed may be in no mission.
Result<RobotId> number_of(const std::string& name, const std::vector<std::string>& names, bool is_live) {
  if (Status ok = check_robot_name(name); !ok) return tl::unexpected(ok.error());
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return RobotId{static_cast<std::uint32_t>(found - names.begin())};
  if (is_live) return robot_id_of(name);
  return fail(ErrorCode::configuration, "--name {}: no robot of the mission is called so; there are: {}", name,
              fmt::join(names, ", "));
}

class RobotProgram {
 public:
  explicit RobotProgram(const RobotOptions& options) : options_(options) {}
  Status start();
  Status run(const std::atomic<bool>& stop);

 private:
  Status read_mission();
  Status read_recording();
  [[nodiscard]] double begin_s(const mission::RobotActor& actor) const;
  Result<std::unique_ptr<mission::RobotActor>> open_actor();
  Result<std::unique_ptr<Hosted>> open_node(bus::Port& port);
  void tell_alone();

  const RobotOptions& options_;
  mission::MissionConfig config_;
  std::vector<std::string> names_;  // of the mission's robots, by their number
  RobotId robot_;
  mission::MissionRecording recording_;  // empty when the robot is fed
  double duration_s_ = 0.0;
  std::optional<StateFolder> folder_;
  std::unique_ptr<EventLog> log_;
  std::unique_ptr<storage::TableStore> store_;
  std::unique_ptr<bus::MissionLease> lease_;  // not its own: it looks for the server's
  std::string alone_;                         // as it was told last
  std::optional<Clock> clock_;
  std::optional<Host> host_;
};

/// Once a second: whether its mission has no server here, but others have.
void RobotProgram::tell_alone() {
  const std::string why = lease_->why_alone();
  if (why == alone_) return;
  log_->say(why.empty() ? Level::info : Level::warning, why.empty() ? "there is a server of its mission" : why);
  alone_ = why;
}

Status RobotProgram::read_mission() {
  auto config = load(options_.mission);
  if (!config) return tl::unexpected(config.error());
  config_ = std::move(*config);
  names_ = robot_names(config_);
  const bool is_live = !options_.feed.empty();
  const auto number = number_of(options_.name, names_, is_live);
  if (!number) return tl::unexpected(number.error());
  robot_ = *number;
  if (!is_live) return read_recording();
  recording_.recording.robot = robot_;
  recording_.recording.name = options_.name;
  recording_.score_against_reference = false;
  return {};
}

Status RobotProgram::read_recording() {
  auto input = mission::load_input(config_, options_.mission.data, options_.mission.seed);
  if (!input) return tl::unexpected(input.error());
  duration_s_ = duration_of(config_, input->robots);
  recording_ = std::move(input->robots.at(robot_.value));
  return {};
}

Result<std::unique_ptr<mission::RobotActor>> RobotProgram::open_actor() {
  const node::RobotNodeConfig config{.agent = config_.agent,
                                     .name = options_.name,
                                     .uplink = {.bytes_per_s = options_.uplink_bytes_per_s},
                                     .max_archive_bytes = options_.max_archive_bytes};
  return mission::RobotActor::open(recording_, config, config_.association,
                                   agent_randomness(options_.mission.seed, options_.name),
                                   options_.session.value_or(folder_->made_ns()), *store_);
}

Result<std::unique_ptr<Hosted>> RobotProgram::open_node(bus::Port& port) {
  auto actor = open_actor();
  if (!actor) return in_context((folder_->path() / kRobotFile).string(), actor.error());
  auto robot = std::make_unique<HostedRobot>(std::move(*actor), duration_s_, options_, *clock_,
                                             dynamic_cast<const bus::NatsPort&>(port), *log_, alone_);
  if (options_.feed.empty()) return robot;
  std::map<RobotId, std::string> names;
  for (std::size_t i = 0; i < names_.size(); ++i) names[RobotId{static_cast<std::uint32_t>(i)}] = names_[i];
  if (Status fed = robot->feed_live(*host_, RobotView(options_.name, std::move(names))); !fed)
    return tl::unexpected(fed.error());
  return robot;
}

/// A recording is replayed from where it stood; for a robot that is fed, time has passed.
double RobotProgram::begin_s(const mission::RobotActor& actor) const {
  if (!options_.feed.empty()) return options_.rate * folder_->age_s();
  return folder_->is_new() ? 0.0 : std::min(actor.next_time(), duration_s_);
}

Status RobotProgram::start() {
  if (Status read = read_mission(); !read) return read;
  auto folder = StateFolder::open(options_.state, "robot " + options_.name);
  if (!folder) return tl::unexpected(folder.error());
  folder_.emplace(std::move(*folder));
  auto log = EventLog::open(folder_->path(), options_.name, options_.console);
  if (!log) return tl::unexpected(log.error());
  log_ = std::move(*log);
  auto store = storage::open_sqlite_store(folder_->path() / kRobotFile, storage::robot_schema());
  if (!store) return tl::unexpected(store.error());
  store_ = std::move(*store);
  const auto actor = open_actor();  // where the recording stood
  if (!actor) return in_context((folder_->path() / kRobotFile).string(), actor.error());
  clock_.emplace(options_.rate, begin_s(**actor));
  const auto mission = name_on_bus(options_.mission, config_);
  if (!mission) return tl::unexpected(mission.error());
  const bus::NatsPortOptions where{.url = options_.bus, .mission = *mission, .allow_insecure = options_.insecure};
  auto lease = bus::MissionLease::open(where, std::nullopt);
  if (!lease) return tl::unexpected(lease.error());
  lease_ = std::move(*lease);
  host_.emplace(Host::Parts{.store = store_.get(),
                            .open_port = [this, where]() -> Result<std::unique_ptr<bus::Port>> {
                              return bus::open_nats_port(bus::Endpoint::of(robot_), where);
                            },
                            .open_node = [this](bus::Port& port) { return open_node(port); },
                            .each_second = [this] { tell_alone(); },
                            .status_file = folder_->path() / kStatusFile,
                            .table_aside = "meta",
                            .version = options_.version},
                *clock_, *log_);
  if (Status opened = host_->open(); !opened) return opened;
  log_->say(Level::info, fmt::format("robot {} runs in {}, bus {}, {}, {}", robot_.value, folder_->path().string(),
                                     options_.bus, options_.feed.empty() ? "replays" : "is fed at " + options_.feed,
                                     folder_->is_new() ? "a new session" : "goes on"));
  return {};
}

Status RobotProgram::run(const std::atomic<bool>& stop) {
  tell_service_manager("READY=1");
  host_->run(stop);
  tell_service_manager("STOPPING=1");
  const auto* robot = dynamic_cast<const HostedRobot*>(host_->hosted());
  log_->write(last_words(host_->traffic(), robot));
  if (robot != nullptr && robot->refused())
    return fail(ErrorCode::invalid,
                "the server refuses this robot: {}: stop the other one, give this one another name, or name it in the "
                "server's mission",
                *robot->refused());
  if (robot == nullptr || stop || robot->is_whole_in_map())
    log_->say(Level::info, "stops; everything is stored");
  else
    log_->say(Level::warning, fmt::format("stops; in {} s no map came that contains this robot's last submap, which "
                                          "the server has",
                                          kWaitsForMap_s));
  return {};
}

}  // namespace

Status run_robot(const RobotOptions& options, const std::atomic<bool>& stop) {
  RobotProgram program(options);
  if (Status started = program.start(); !started) return started;
  return program.run(stop);
}

}  // namespace tutti::program
