// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/program/robot_program.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "tutti/base/plain_name.hpp"
#include "tutti/bus/mission_lease.hpp"
#include "tutti/geometry/pose3.hpp"
#include "tutti/program/feed/live_feed.hpp"
#include "tutti/program/field_json.hpp"
#include "tutti/program/host.hpp"
#include "tutti/program/hosted_robot.hpp"
#include "tutti/program/incarnation.hpp"
#include "tutti/program/server_program.hpp"
#include "tutti/program/state_folder.hpp"
#include "tutti/program/stop.hpp"
#include "tutti/wire/message_kind.hpp"

namespace tutti::program {
namespace {

/// The last event of a program: what only it knows.
Json last_words(const Host::TrafficTable& table, const std::optional<NodeStatus>& status) {
  Json rows = Json::array();
  for (const auto& [key, traffic] : table)
    rows.push_back({{"sent", key.first},
                    {"kind", wire::name(key.second)},
                    {"messages", traffic.messages},
                    {"bytes", traffic.bytes},
                    {"largest", traffic.largest}});
  Json out{{"event", kEnded}, {"traffic", std::move(rows)}};
  if (status) out["status"] = json_of_fields(*status);
  return out;
}

/// The name must be one that a status may carry and that a systemd unit, a folder and a subject of the bus can have.
Status check_robot_name(const std::string& name) {
  constexpr std::size_t kLongest = 64;
  if (is_plain_name(name, kLongest)) return {};
  const auto wrong = std::ranges::find_if_not(name, is_plain);
  const std::string what =
      wrong == name.end() ? fmt::format("{} letters", name.size()) : fmt::format("'{}' is none of these", *wrong);
  return fail(ErrorCode::configuration,
              "--name '{}': {}; a robot is known on the bus by 1 to {} letters, digits, '_' and '-'", name, what,
              kLongest);
}

class RobotProgram {
 public:
  explicit RobotProgram(const RobotOptions& options) : options_(options) {}
  Status start();
  Status run(const std::atomic<bool>& stop);

 private:
  [[nodiscard]] double begin_s(drive::Driver& robot) const;
  Result<std::unique_ptr<node::RobotNode>> open_robot();
  Result<std::unique_ptr<Hosted>> open_node(bus::Port& port);
  [[nodiscard]] RobotView view() const;
  Status open_feed(const node::RobotNode& node);
  void tell_alone();
  void tell_feed();
  void follow_maps();

  const RobotOptions& options_;
  const std::uint32_t incarnation_ = any_incarnation();
  RobotId robot_;
  std::optional<StateFolder> folder_;
  std::unique_ptr<EventLog> log_;
  std::unique_ptr<storage::TableStore> store_;
  std::unique_ptr<bus::MissionLease> lease_;  // not its own: it finds the server's
  std::string alone_;                         // as it was reported last
  std::optional<Clock> clock_;
  std::unique_ptr<LiveFeed> feed_;                  // null: it replays
  std::shared_ptr<void> feeder_;                    // RobotOptions::beside_feed
  std::unique_ptr<MapFetcher> maps_;                // null: it does not localise in published maps
  LocaliseSetup localise_;                          // null: it has no map to localise in
  std::optional<std::pair<Pose3, double>> stands_;  // where, and since when
  FeedFront::Load load_;                            // as it was reported last
  bool odometry_refused_ = false;                   // as it was reported last
  std::optional<Host> host_;
};

/// Once a second: whether its mission has no server here, but others have.
void RobotProgram::tell_alone() {
  const std::string why = lease_->why_alone();
  if (why == alone_) return;
  log_->say(why.empty() ? Level::info : Level::warning, why.empty() ? "there is a server of its mission" : why);
  alone_ = why;
}

Result<std::unique_ptr<node::RobotNode>> RobotProgram::open_robot() {
  node::RobotNodeConfig config{.agent = options_.settings.agent,
                               .name = options_.name,
                               .incarnation = incarnation_,
                               .uplink = {.bytes_per_s = options_.uplink_bytes_per_s},
                               .max_archive_bytes = options_.max_archive_bytes,
                               .localise = localise_};
  config.keeps_state = !options_.is_alone;
  if (feed_) {
    const auto sensors = feed_->front().sensors();
    config.agent.submap.has_scans = sensors->scans;
    config.agent.submap.has_images = !sensors->cameras.empty();
  }
  if (options_.replay.recording) config.agent = drive::with_sensors(config.agent, *options_.replay.recording);
  auto node = node::RobotNode::open(robot_, options_.session.value_or(folder_->made_ns()), config, *store_);
  if (!node) return in_context((folder_->path() / kRobotFile).string(), node.error());
  return node;
}

Result<std::unique_ptr<Hosted>> RobotProgram::open_node(bus::Port& port) {
  auto node = open_robot();
  if (!node) return tl::unexpected(node.error());
  auto robot = std::make_unique<HostedRobot>(std::move(*node), options_, *clock_, port, *log_, alone_, maps_.get());
  if (feed_) robot->feed_live(*feed_, *host_, view());
  return robot;
}

RobotView RobotProgram::view() const {
  std::map<RobotId, std::string> names;
  const std::vector<std::string>& robots = options_.settings.robots;
  for (std::size_t i = 0; i < robots.size(); ++i) names[RobotId{static_cast<std::uint32_t>(i)}] = robots[i];
  return RobotView(options_.name, std::move(names));
}

Status RobotProgram::open_feed(const node::RobotNode& node) {
  if (options_.feed.empty()) return {};
  auto feed = LiveFeed::open(options_.feed, options_.feed_access, view().state(node), options_.settings.sensors);
  if (!feed) return tl::unexpected(feed.error());
  feed_ = std::move(*feed);
  if (options_.beside_feed) feeder_ = options_.beside_feed(*feed_);
  return {};
}

/// Once a second: what the feed must know of the host, and the log of the feed.
void RobotProgram::tell_feed() {
  if (!feed_) return;
  const std::string& trouble = host_->trouble();
  feed_->front().say_trouble(trouble.empty() ? "" : "the map waits, localisation goes on by odometry: " + trouble);
  if (const std::string thrown = feed_->take_thrown(); !thrown.empty())
    log_->say(Level::error, "the feed has thrown, which is a defect of it; clients have to connect again: " + thrown);
  const std::string refused = feed_->front().odometry_trouble();
  if (const bool is_refused = !refused.empty(); is_refused != odometry_refused_) {
    odometry_refused_ = is_refused;
    log_->say(is_refused ? Level::warning : Level::info, is_refused ? refused : "odometry is taken again");
  }
  const FeedFront::Load load = feed_->front().load(), before = std::exchange(load_, load);
  const std::size_t now = load.scans_left_out + load.samples_joined + load.images_left_out,
                    was = before.scans_left_out + before.samples_joined + before.images_left_out;
  if (now > 0 && was == 0)
    log_->say(Level::warning,
              fmt::format("the map is behind what is fed: {} inputs wait; {} scans and {} images are left out so far, "
                          "then odometry is taken together; poses are answered all the same",
                          load.waiting, load.scans_left_out, load.images_left_out));
  if (now == 0 && was > 0)
    log_->say(Level::info,
              fmt::format("the map has caught up with what is fed: {} scans and {} images were left out, {} "
                          "odometry samples taken together",
                          before.scans_left_out, before.images_left_out, before.samples_joined));
}

/// Once a second: another map is taken when the robot has stood for a while, the first one at once. The node is made
/// anew with it: the robot's own trajectory goes on, and its last place is tried first.
void RobotProgram::follow_maps() {
  constexpr double kStands_s = 3.0, kMoved_m = 0.05, kTurned_rad = 0.03;
  auto* const robot = dynamic_cast<HostedRobot*>(host_->hosted());
  if (!maps_ || robot == nullptr) return;
  const Pose3 now = robot->node_status(clock_->now()).T_odom_body;
  const Pose3 moved = stands_ ? stands_->first.inverse() * now : Pose3{};
  const bool has_moved = moved.translation.norm() > kMoved_m || rotation_angle(moved) > kTurned_rad;
  if (!stands_ || has_moved) stands_ = {now, clock_->wall_s()};
  if (!maps_->has_news() || (localise_ && clock_->wall_s() < stands_->second + kStands_s)) return;
  if (!host_->carry_out(robot->store_all())) return;  // the disk is full: later
  localise_ = maps_->take();
  log_->say(Level::info,
            fmt::format("localises in version {} of map {} from now on", localise_->map->revision, localise_->map->id));
  host_->start_anew();
}

/// A recording is replayed from where it stood; for a robot that is fed, time has passed.
double RobotProgram::begin_s(drive::Driver& robot) const {
  if (!options_.feed.empty()) return options_.rate * folder_->age_s();
  const RobotReplay& replay = options_.replay;
  if (folder_->is_new()) return 0.0;
  return std::min(drive::Replay(*replay.recording, replay.start_s, robot).next_time(), replay.duration_s);
}

Status RobotProgram::start() {
  const auto number = number_of(options_.name, options_.settings.robots, !options_.feed.empty());
  if (!number) return tl::unexpected(number.error());
  robot_ = *number;
  auto folder = StateFolder::open(options_.state, "robot " + options_.name);
  if (!folder) return tl::unexpected(folder.error());
  folder_.emplace(std::move(*folder));
  auto log = EventLog::open(folder_->path(), options_.name, options_.console);
  if (!log) return tl::unexpected(log.error());
  log_ = std::move(*log);
  auto stored = open_robot_store(folder_->path(), wall_clock_ns());
  if (!stored) return tl::unexpected(stored.error());
  store_ = std::move(stored->store);
  if (!stored->damage.empty()) log_->say(Level::error, stored->damage);
  bus::BusOptions where = options_.bus;
  where.mission = options_.settings.mission;
  localise_ = options_.localise;
  if (options_.open_map) {
    auto board = bus::open_maps(where);
    if (!board) return tl::unexpected(board.error());
    maps_ = std::make_unique<MapFetcher>(
        std::move(*board), publishing::KeptMaps(folder_->path() / "maps", where.credentials), options_.open_map, *log_);
    localise_ = maps_->take();
  }
  auto node = open_robot();
  if (!node) return tl::unexpected(node.error());
  drive::Driver stood(std::move(*node));  // as it was stored
  clock_.emplace(options_.rate, begin_s(stood));
  auto lease = bus::MissionLease::open(where, std::nullopt);
  if (!lease) return tl::unexpected(lease.error());
  lease_ = std::move(*lease);
  host_.emplace(Host::Parts{.store = store_.get(),
                            .open_port = [this, where] { return bus::open_port(bus::Endpoint::of(robot_), where); },
                            .open_node = [this](bus::Port& port) { return open_node(port); },
                            .each_second =
                                [this] {
                                  tell_alone();
                                  tell_feed();
                                  follow_maps();
                                },
                            .status_file = folder_->path() / kStatusFile,
                            .table_aside = "meta",
                            .version = options_.version},
                *clock_, *log_);
  if (Status opened = open_feed(stood.node()); !opened) return opened;
  // On a full disk there is no map, but clients learn where they are.
  if (Status opened = host_->open(); !opened && !(feed_ && host_->tries_again())) return opened;
  log_->say(Level::info, fmt::format("robot {} runs in {}, bus {}, {}, {}", robot_.value, folder_->path().string(),
                                     bus::without_credentials(options_.bus.url),
                                     options_.feed.empty() ? "replays" : "is fed at " + options_.feed,
                                     folder_->is_new() ? "a new session" : "goes on"));
  return {};
}

Status RobotProgram::run(const std::atomic<bool>& stop) {
  notify_service_manager("READY=1");
  host_->run(stop);
  notify_service_manager("STOPPING=1");
  const auto* robot = dynamic_cast<const HostedRobot*>(host_->hosted());
  log_->write(last_words(host_->traffic(), robot ? std::optional(robot->node_status(clock_->now())) : std::nullopt));
  if (robot != nullptr && robot->refused())
    return fail(ErrorCode::invalid,
                "the server refuses this robot: {}: stop the other one, give this one another name, or name it in the "
                "server's mission",
                *robot->refused());
  if (robot == nullptr)
    log_->say(Level::error, "stops; what came last is not stored: " + host_->trouble());
  else if (options_.is_alone)
    log_->say(Level::info, "stops; it was alone, and nothing of what it saw is kept");
  else if (stop || robot->is_whole_in_map())
    log_->say(Level::info, "stops; everything is stored");
  else
    log_->say(Level::warning, fmt::format("stops; in {} s no map came that contains this robot's last submap, which "
                                          "the server has",
                                          HostedRobot::kWaitsForMap_s));
  return {};
}

}  // namespace

Result<RobotId> number_of(const std::string& name, const std::vector<std::string>& names, bool is_fed) {
  if (Status ok = check_robot_name(name); !ok) return tl::unexpected(ok.error());
  const auto found = std::ranges::find(names, name);
  if (found != names.end()) return RobotId{static_cast<std::uint32_t>(found - names.begin())};
  if (is_fed) return robot_id_of(name);
  return fail(ErrorCode::configuration, "--name {}: no robot of the mission is called so; there are: {}", name,
              fmt::join(names, ", "));
}

Status run_robot(const RobotOptions& options, const std::atomic<bool>& stop) {
  RobotProgram program(options);
  if (Status started = program.start(); !started) return started;
  return program.run(stop);
}

}  // namespace tutti::program
