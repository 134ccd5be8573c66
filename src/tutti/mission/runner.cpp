// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/runner.hpp"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/freed_memory.hpp"
#include "tutti/bus/simulated_network.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/mission/load_meter.hpp"
#include "tutti/mission/make_record.hpp"
#include "tutti/mission/mission_events.hpp"
#include "tutti/mission/pace.hpp"
#include "tutti/mission/perfect_course.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/mission/robot_actor.hpp"
#include "tutti/mission/server_meter.hpp"
#include "tutti/mission/view_recorder.hpp"
#include "tutti/node/map_meta.hpp"
#include "tutti/node/robot_registry.hpp"
#include "tutti/node/server_node.hpp"
#include "tutti/node/submap_frames.hpp"
#include "tutti/node/worker_node.hpp"
#include "tutti/storage/memory_store.hpp"
#include "tutti/verifiers/parallel.hpp"
#include "tutti/verifiers/sensor_verifier_maker.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::mission {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kPatience_s = 86400.0;  // after the end, for what is still under way
constexpr double kProgress_s = 10.0;     // between two reports of it
constexpr std::uint64_t kEpoch = 1;      // the server starts once
const bus::Endpoint kWorker = bus::Endpoint::worker(0);

class MissionRun {
 public:
  MissionRun(const MissionConfig& config, const RunOptions& options, MissionParts parts)
      : config_(config),
        options_(options),
        recordings_(std::move(parts.input.robots)),
        survey_(std::move(parts.input.survey)),
        threads_(options.threads > 0 ? static_cast<std::size_t>(options.threads)
                                     : std::max(1U, std::thread::hardware_concurrency())),
        meter_(std::move(parts.verifier), std::move(parts.refiner)),
        network_(radio(), kMissionStart),
        store_(storage::map_schema(), options.map.rows),
        server_(node::ServerNode::open(robot_ids(recordings_), meter_.verifier(),
                                       {.server = config.server,
                                        .pairs_per_job = SubmapPair::kMost,
                                        .job_timeout_s = 0.0,
                                        .refiner = meter_.refiner()},
                                       kEpoch, store_)
                    .value()),
        worker_(kWorker, meter_.verifier(), node::SubmapFrames::of(store_),
                [this](std::size_t count, const auto& call) { verifiers::for_each_parallel(count, threads_, call); }),
        server_port_(network_.connect(bus::Endpoint::server())),
        worker_port_(network_.connect(kWorker)),
        pace_(options.rate),
        view_(duration_of(config, recordings_)) {
    keep_freed_memory();
    worker_.refine_with(meter_.refiner());
    for (const MissionRecording& recording : recordings_) {
      robots_.push_back(
          {std::make_unique<RobotActor>(recording, config.agent, config.association,
                                        parts.companions ? parts.companions(recording.recording) : nullptr),
           network_.connect(bus::Endpoint::of(recording.recording.robot))});
    }
    duration_s_ = duration_of(config, recordings_);
  }

  void run() {
    carry_out(*server_port_, server_->resume(now()));
    double next_progress_s = kProgress_s;
    while (true) {
      if (!would_end_s_ && options_.stop && options_.stop()) would_end_s_ = std::exchange(duration_s_, time_s_);
      const double sample_s = next_sample();
      if (sample_s == kNever)
        for (Robot& robot : robots_) {
          robot.actor->finish(now());
          carry_out(*robot.port, robot.actor->take_step());
        }
      const double delivery_s = next_delivery(), timer_s = std::min(next_timer(), next_worker());
      if (sample_s == kNever && delivery_s > duration_s_ + kPatience_s && timer_s == kNever) {
        if (!deliver()) break;  // or a worker was asked last
        continue;
      }
      time_s_ = std::min({sample_s, delivery_s, timer_s});
      pace_.wait_until(time_s_);
      deliver();
      if (sample_s <= time_s_) replay();
      if (next_timer() <= time_s_) {
        update_map();
        deliver();  // what it asks workers for is answered now, and not at whatever happens next
      }
      if (next_worker() <= time_s_) carry_out(*worker_port_, worker_.on_timer(now()));
      if (time_s_ < next_progress_s) continue;
      tell_progress();
      while (next_progress_s <= time_s_) next_progress_s += kProgress_s;
    }
  }

  /// Fails when a robot was to have scans and not one could be taken.
  [[nodiscard]] Status check_scans() const {
    for (const Robot& robot : robots_)
      if (auto ok = robot.actor->check_scans(); !ok) return ok;
    return {};
  }
  /// The server's map, with the names that robots send in statuses, which a mission in virtual time does not have. A
  /// robot that has not begun has none: it may be one of an earlier day.
  [[nodiscard]] const storage::TableStore& named_map() {
    std::vector<storage::Write> rows;
    std::set<RobotId> mapped;
    for (const auto& [id, submap] : server_->map_server().state().submaps) mapped.insert(id.chain.robot);
    for (const MissionRecording& recording : recordings_) {
      if (!mapped.contains(recording.recording.robot)) continue;
      const std::string key = node::RobotRegistry::key(recording.recording.robot);
      const auto stored = store_.read(map_tables::kMeta, key).value();
      node::RobotRow row = stored ? node::decode_robot(*stored).value() : node::RobotRow{};
      row.name = recording.recording.name;
      rows.push_back({map_tables::kMeta, key, node::encode(row)});
    }
    TUTTI_CHECK(store_.commit(rows).has_value(), "a store in memory");
    return store_;
  }
  /// Ends it: called once.
  MissionRecord record();

 private:
  struct Robot {
    std::unique_ptr<RobotActor> actor;
    std::unique_ptr<bus::Port> port;
    double worst_latency_ms = 0.0;    ///< Among its updates.
    std::optional<NodeStatus> heard;  ///< Its status when the radio reached it last.
  };

  static std::set<RobotId> robot_ids(const std::vector<MissionRecording>& recordings) {
    std::set<RobotId> ids;
    for (const MissionRecording& recording : recordings) ids.insert(recording.recording.robot);
    return ids;
  }
  [[nodiscard]] bus::SimulatedRadio radio() const {
    bus::SimulatedRadio radio(kMissionStart, config_.link, options_.seed);
    for (const RobotLinkConfig& own : config_.robot_links)
      for (const MissionRecording& recording : recordings_)
        if (recording.recording.name == own.robot) radio.set_link(recording.recording.robot, own.link);
    return radio;
  }

  [[nodiscard]] Timestamp now() const { return kMissionStart + time_s_; }
  [[nodiscard]] double next_sample() const {
    double next = kNever;
    for (const Robot& robot : robots_) next = std::min(next, robot.actor->next_time());
    return next > duration_s_ ? kNever : next;
  }
  [[nodiscard]] double next_delivery() const {
    const auto next = network_.next_delivery();
    return next ? *next - kMissionStart : kNever;
  }
  [[nodiscard]] double next_timer() const { return seconds_to(server_->next_timer()); }
  [[nodiscard]] double next_worker() const { return seconds_to(worker_.next_timer()); }
  static double seconds_to(std::optional<Timestamp> next) {
    return next ? static_cast<double>(next->ns - kMissionStart.ns) / 1e9 : kNever;
  }

  /// Nobody kills the nodes of a mission: what they would write matters to the server's workers only.
  void carry_out(bus::Port& port, node::Step step) {
    if (&port == server_port_.get()) {
      const Status stored = store_.commit(step.writes);
      TUTTI_CHECK(stored.has_value(), "{}", stored.error().message);
    }
    for (bus::Envelope& message : step.messages) {
      const Status sent = port.send(std::move(message));
      TUTTI_CHECK(sent.has_value(), "{}", sent.error().message);
    }
    for (const node::Event& event : step.events) events_.take(event);
  }

  void replay() {
    std::vector<Robot*> due;
    for (Robot& robot : robots_)
      if (robot.actor->next_time() <= time_s_) due.push_back(&robot);
    // A simulated scan or image is much work, an odometry sample hardly any.
    const bool heavy = std::ranges::any_of(due, [](const Robot* robot) { return robot->actor->has_sensors(); });
    verifiers::for_each_parallel(due.size(), heavy ? threads_ : 1,
                                 [&](std::size_t i) { due[i]->actor->replay_next(now()); });
    for (Robot* robot : due) carry_out(*robot->port, robot->actor->take_step());
  }

  /// All that is there at this instant, and what that makes others send: between server and worker it takes no time.
  /// False: there was nothing.
  bool deliver() {
    bool any = false;
    for (bool moved = true; moved; any = any || moved) {
      network_.advance(now());
      moved = hear(*server_port_, [&](const bus::Envelope& message) {
        return meter_.serve(time_s_, [&] { return server_->receive(message, now()); });
      });
      moved = hear(*worker_port_,
                   [&](const bus::Envelope& message) {
                     return meter_.verify(message.id, [&] { return worker_.receive(message, now()); });
                   }) ||
              moved;
      for (Robot& robot : robots_)
        moved = hear(*robot.port,
                     [&](const bus::Envelope& message) {
                       robot.actor->receive(message, now());
                       robot.worst_latency_ms = std::max(robot.worst_latency_ms, pace_.late_ms(time_s_));
                       return robot.actor->take_step();
                     }) ||
                moved;
    }
    return any;
  }
  template <class Node>
  bool hear(bus::Port& port, Node&& node) {
    const auto received = port.receive();
    for (const bus::Received& message : received) {
      carry_out(port, node(message.envelope));
      port.acknowledge(message.ticket);
    }
    return !received.empty();
  }

  void update_map() {
    carry_out(*server_port_, meter_.update(time_s_, [&] {
      node::Step step = server_->on_timer(now());
      return_freed_memory();
      return step;
    }));
    std::vector<const MissionRecording*> recordings;
    for (const MissionRecording& recording : recordings_) recordings.push_back(&recording);
    const server::MapServer& server = server_->map_server();
    if (const auto check = check_closures(server.map(), recordings, config_.association, config_.closure_check))
      events_.set_wrong(check->wrong);
    if (const std::uint64_t revision = server.state().revision; std::exchange(revision_, revision) != revision) {
      if (options_.updated) options_.updated(server);
      perfect_.update(server, server_->broadcast(), config_.server.map, recordings, config_.association,
                      config_.closure_check);
    }
    if (server_->has_map() && view_.wants(time_s_)) view_.take(shown_map(), status());
    server_latency_ms_ = std::max(server_latency_ms_, pace_.late_ms(time_s_));
  }

  /// With the names that robots send in statuses, which a mission in virtual time does not have.
  [[nodiscard]] mapfile::ShownMap shown_map() {
    mapfile::ShownMap shown = shown_maps_.of(*server_, now());
    for (const MissionRecording& recording : recordings_)
      shown.content.names[recording.recording.robot] = recording.recording.name;
    return shown;
  }

  /// As the server would know it if robots sent their statuses, as programs do: virtual time's radio carries none, so
  /// that a mission's bytes are those of its map. A robot out of contact is as it was when that was lost.
  [[nodiscard]] MissionStatus status() {
    MissionStatus out = server_->mission_status(now());
    for (Robot& robot : robots_) {
      const Timestamp heard_at = network_.radio().last_contact(robot.actor->id(), now());
      if (heard_at == now()) robot.heard = robot.actor->node().status(now());
      const auto entry = std::ranges::find(out.robots, robot.actor->id(), &MissionStatus::Robot::robot);
      if (entry == out.robots.end() || !robot.heard) continue;
      entry->status = *robot.heard;
      entry->status.name = robot.actor->recording().recording.name;
      entry->last_seen = heard_at;
      if (robot.heard->update_age_s) entry->last_update = heard_at - *robot.heard->update_age_s;
    }
    return out;
  }

  void tell_progress() const {
    if (!options_.progress) return;
    const server::MapServer& server = server_->map_server();
    options_.progress({time_s_, duration_s_, server.state().submaps.size(),
                       events_.updates().empty() ? 0 : events_.updates().back().closures, server.map().components});
  }

  void record_timing(MissionRecord& record) const;

  const MissionConfig& config_;
  const RunOptions& options_;
  std::vector<MissionRecording> recordings_;
  std::shared_ptr<const PointCloud> survey_;
  std::size_t threads_;
  ServerMeter meter_;
  bus::SimulatedNetwork network_;
  storage::MemoryStore store_;  // the map's
  std::unique_ptr<node::ServerNode> server_;
  node::WorkerNode worker_;
  std::unique_ptr<bus::Port> server_port_, worker_port_;
  Pace pace_;
  mapfile::ShownMaps shown_maps_{store_};
  ViewRecorder view_;
  std::vector<Robot> robots_;  // by RobotId
  MissionEvents events_;
  PerfectCourse perfect_;
  std::uint64_t revision_ = 0;
  double time_s_ = 0.0;
  double duration_s_ = 0.0;
  std::optional<double> would_end_s_;  // once it is to stop: then nothing is replayed any more
  double server_latency_ms_ = 0.0;
};

void MissionRun::record_timing(MissionRecord& record) const {
  meter_.record(duration_s_, record.timing);
  const server::ServerWork& work = server_->map_server().work();
  record.timing.server_work = {.updates = work.updates,
                               .pairs_looked_at = work.pairs_looked_at,
                               .pairs_verified = work.pairs_verified,
                               .hypotheses = work.search.hypotheses,
                               .factorisations = work.search.factorisations + work.monitor.factorisations,
                               .sample_products = work.monitor.products,
                               .places_compared = work.places_compared};
  record.timing.machine = machine_description();
  record.timing.wall_s = pace_.wall_s();
  record.timing.rate = options_.rate;
  for (const Robot& robot : robots_)
    for (PolicyTiming& policy : robot.actor->timing()) record.timing.policies.push_back(std::move(policy));
  if (!options_.rate) return;
  for (const Robot& robot : robots_)
    record.timing.load.push_back(
        {robot.actor->recording().recording.name, robot.actor->cpu_s() / record.timing.wall_s, robot.worst_latency_ms});
  record.timing.load.push_back({"server", meter_.cpu_s() / record.timing.wall_s, server_latency_ms_});
}

MissionRecord MissionRun::record() {
  FinishedMission mission{.config = config_,
                          .seed = options_.seed,
                          .version = options_.version,
                          .settings_yaml = options_.settings_yaml,
                          .duration_s = duration_s_,
                          .survey = survey_,
                          .robots = {},
                          .server = *server_,
                          .events = events_,
                          .perfect = perfect_,
                          .undelivered = network_.radio().undelivered()};
  for (const Robot& robot : robots_) {
    const RobotActor& actor = *robot.actor;
    mission.robots.push_back({.outcome = actor.outcome(),
                              .updates = actor.updates(),
                              .explanation = actor.explanation(),
                              .troubles = actor.troubles(),
                              .refused_images = actor.refused_images(),
                              .traffic = traffic_of(network_.radio(), actor.id(), actor.recording().recording.name),
                              .status = actor.node().status(now()),
                              .misfits = actor.misfits()});
  }
  MissionRecord record = make_record(mission);
  if (would_end_s_) record.notes.push_back(fmt::format("stopped at {:.0f} of {:.0f} s", duration_s_, *would_end_s_));
  record_timing(record);
  record.view = std::make_shared<const ViewRecord>(
      std::move(view_).finish(shown_map(), status(), *node::SubmapFrames::of(store_)));
  return record;
}

/// A radio for a robot that is not there would silently do nothing.
Status check_links(const MissionConfig& config, const std::vector<MissionRecording>& robots) {
  for (const RobotLinkConfig& own : config.robot_links)
    if (std::ranges::none_of(robots, [&](const MissionRecording& r) { return r.recording.name == own.robot; }))
      return fail(ErrorCode::configuration, "robot_links: no robot is called '{}'", own.robot);
  return {};
}

}  // namespace

double duration_of(const MissionConfig& config, const std::vector<MissionRecording>& recordings) {
  double duration_s = 0.0;
  for (const MissionRecording& recording : recordings) {
    const Trajectory& odometry = recording.recording.odometry;
    duration_s = std::max(duration_s, recording.start_s + (odometry.back().stamp - odometry.front().stamp));
  }
  return config.duration_s > 0.0 ? std::min(duration_s, config.duration_s) : duration_s;
}

Result<MissionRecord> run_mission(const MissionConfig& config, const RunOptions& options) {
  auto input = load_input(config, options.data, options.seed);
  if (!input) return tl::unexpected(input.error());
  return run_mission(config,
                     {.input = std::move(*input),
                      .verifier = verifiers::make_verifier(config.closures),
                      .refiner = verifiers::make_refiner(config.closures, config.refinement),
                      .companions = {}},
                     options);
}

Result<MissionRecord> run_mission(const MissionConfig& config, MissionParts parts, const RunOptions& options) {
  if (const auto ok = check_links(config, parts.input.robots); !ok) return tl::unexpected(ok.error());
  if (options.stop && options.stop())
    return fail(ErrorCode::invalid, "stopped before the mission began: nothing to report");
  if (options.warn)
    for (const MissionRecording& robot : parts.input.robots) std::ranges::for_each(robot.warnings, options.warn);
  MissionRun mission(config, options, std::move(parts));
  mission.run();
  if (const auto ok = mission.check_scans(); !ok) return tl::unexpected(ok.error());
  if (options.keep_map)
    if (const auto ok = options.keep_map(mission.named_map()); !ok) return tl::unexpected(ok.error());
  return mission.record();
}

}  // namespace tutti::mission
