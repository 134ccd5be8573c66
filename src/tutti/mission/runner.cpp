// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/runner.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <thread>

#include "tutti/base/config_io.hpp"
#include "tutti/bus/simulated_radio.hpp"
#include "tutti/mission/closure_finders.hpp"
#include "tutti/mission/disk_cloud_store.hpp"
#include "tutti/mission/evaluate.hpp"
#include "tutti/mission/follow_alerts.hpp"
#include "tutti/mission/load_meter.hpp"
#include "tutti/mission/parallel.hpp"
#include "tutti/mission/record_notes.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/mission/robot_actor.hpp"
#include "tutti/wire/codec.hpp"

namespace tutti::mission {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kPatience_s = 86400.0;  // after the end, for what is still under way
constexpr std::uint64_t kEpoch = 1;      // the server starts once
constexpr Timestamp kMissionStart{0};    // virtual time; robots' own stamps are never compared with it

/// Keeps virtual time in step with the wall clock, when asked to.
class Pace {
 public:
  explicit Pace(std::optional<double> rate) : rate_(rate) {}
  void wait_until(double time_s) const {
    if (rate_) std::this_thread::sleep_until(start_ + std::chrono::duration<double>(time_s / *rate_));
  }
  /// Wall milliseconds since the moment that `time_s` stood for.
  [[nodiscard]] double late_ms(double time_s) const {
    if (!rate_) return 0.0;
    return std::chrono::duration<double, std::milli>(Clock::now() - start_).count() - 1e3 * time_s / *rate_;
  }
  [[nodiscard]] double wall_s() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;
  std::optional<double> rate_;
  std::chrono::time_point<Clock, std::chrono::duration<double>> start_ = Clock::now();
};

class MissionRun {
 public:
  MissionRun(const MissionConfig& config, const RunOptions& options, MissionInput input,
             std::shared_ptr<server::CloudStore> clouds)
      : config_(config),
        options_(options),
        recordings_(std::move(input.robots)),
        survey_(std::move(input.survey)),
        finder_(make_closure_finder(config.closures, recordings_, options.seed)),
        clouds_(std::move(clouds)),
        server_(robot_ids(recordings_), finder_, clouds_, config.server, kEpoch),
        radio_(kMissionStart, config.link, options.seed),
        threads_(options.threads > 0 ? static_cast<std::size_t>(options.threads)
                                     : std::max(1U, std::thread::hardware_concurrency())),
        pace_(options.rate) {
    std::vector<std::string> policies = config.compare_policies;
    if (std::find(policies.begin(), policies.end(), config.agent.policy.name) == policies.end())
      policies.insert(policies.begin(), config.agent.policy.name);
    for (const RobotLinkConfig& own : config.robot_links)
      for (const MissionRecording& recording : recordings_)
        if (recording.recording.name == own.robot) radio_.set_link(recording.recording.robot, own.link);
    const Rng rng(options.seed);
    for (const MissionRecording& recording : recordings_) {
      robots_.push_back(std::make_unique<RobotActor>(recording, config.agent, policies, config.association,
                                                     rng.fork("agent/" + recording.recording.name)));
      const Trajectory& odometry = recording.recording.odometry;
      duration_s_ = std::max(duration_s_, recording.start_s + (odometry.back().stamp - odometry.front().stamp));
    }
    if (config.duration_s > 0.0) duration_s_ = std::min(duration_s_, config.duration_s);
    worst_latency_ms_.resize(robots_.size(), 0.0);
  }

  void run() {
    double next_update_s = config_.server.update_period_s;
    while (true) {
      const double sample_s = next_sample();
      if (sample_s == kNever) finish_robots();
      const double delivery_s = next_delivery();
      const double now_s = std::min({sample_s, delivery_s, next_update_s});
      if (sample_s == kNever && delivery_s > duration_s_ + kPatience_s && !server_.has_news()) break;
      pace_.wait_until(now_s);
      time_s_ = now_s;
      deliver();
      if (sample_s <= now_s) replay(now_s);
      if (next_update_s <= now_s) {
        update_map();
        next_update_s += config_.server.update_period_s;
      }
    }
  }

  /// Fails when a robot was to have scans and not one could be taken.
  [[nodiscard]] Status check_scans() const {
    for (const auto& robot : robots_)
      if (auto ok = robot->check_scans(); !ok) return ok;
    return {};
  }
  MissionRecord record() const;

 private:
  static std::set<RobotId> robot_ids(const std::vector<MissionRecording>& recordings) {
    std::set<RobotId> ids;
    for (const MissionRecording& recording : recordings) ids.insert(recording.recording.robot);
    return ids;
  }

  [[nodiscard]] double next_sample() const {
    double next = kNever;
    for (const auto& robot : robots_) next = std::min(next, robot->next_time());
    return next > duration_s_ ? kNever : next;
  }
  [[nodiscard]] double next_delivery() const {
    const auto next = radio_.next_delivery();
    return next ? *next - kMissionStart : kNever;
  }

  void replay(double now_s) {
    std::vector<RobotActor*> due;
    for (const auto& robot : robots_)
      if (robot->next_time() <= now_s) due.push_back(robot.get());
    // A simulated scan is much work, an odometry sample hardly any.
    const bool heavy = std::any_of(due.begin(), due.end(), [](const RobotActor* robot) { return robot->has_scans(); });
    for_each_parallel(due.size(), heavy ? threads_ : 1, [&](std::size_t i) { due[i]->replay_next(); });
    for (RobotActor* robot : due) send_submaps(*robot);
  }

  /// Also when the mission ends before the recording; a second time nothing is left to send.
  void finish_robots() {
    for (const auto& robot : robots_) {
      robot->finish();
      send_submaps(*robot);
    }
  }

  void send_submaps(RobotActor& robot) {
    for (const SubmapMessage& message : robot.take_outgoing()) {
      if (const Status ok = wire::validate(message); !ok) {
        refusals_.push_back(ok.error().message);
        continue;
      }
      send(bus::Endpoint::of(robot.id()), bus::Endpoint::server(), wire::MessageKind::submap,
           std::make_shared<const std::string>(wire::encode(message, {.voxel_m = config_.agent.submap.voxel_m})));
    }
  }

  void send(bus::Endpoint from, bus::Endpoint to, wire::MessageKind kind, std::shared_ptr<const std::string> bytes) {
    radio_.send(kMissionStart + time_s_, {from, to, kind, {}, std::move(bytes)});
  }

  void deliver() {
    for (const bus::Arrival& arrival : radio_.deliver_until(kMissionStart + time_s_)) {
      if (arrival.kind == wire::MessageKind::submap)
        receive_submap(*arrival.bytes);
      else if (arrival.kind == wire::MessageKind::proxy_graph && arrival.to.robot())
        receive_proxy_graph(*arrival.to.robot(), *arrival.bytes);
    }
  }

  void receive_submap(const std::string& bytes) {
    if (const Status taken = take_submap(bytes); !taken) return refusals_.push_back(taken.error().message);
    for (const Error& error : server_.take_late_errors()) refusals_.push_back(error.message);
    const double before_s = load_.verification_cpu_s;
    std::vector<server::VerificationJob> jobs = server_.take_jobs();
    const auto verdicts = verify(jobs);
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      const Status ok = verdicts[i] ? server_.receive(*verdicts[i]) : Status(tl::unexpected(verdicts[i].error()));
      const bool is_news = verdicts[i] || unreadable_.insert(jobs[i].pair).second;  // it is tried again and again
      if (!ok && is_news) refusals_.push_back(ok.error().message);
      if (!verdicts[i]) server_.give_back(std::move(jobs[i]));
    }
    unanswered_.push_back({time_s_, load_.verification_cpu_s - before_s});
  }

  Status take_submap(const std::string& bytes) {
    const CpuScope cpu(load_.map_cpu_s);
    const auto message = wire::decode_submap(bytes);
    return message ? server_.receive(*message) : Status(tl::unexpected(message.error()));
  }

  /// The jobs' answers in the jobs' order, whatever the number of threads.
  std::vector<Result<ClosureVerdict>> verify(const std::vector<server::VerificationJob>& jobs) {
    std::vector<Result<ClosureVerdict>> verdicts(jobs.size());
    std::vector<double> took_ms(jobs.size(), 0.0);
    std::vector<double> cpu_s(jobs.size(), 0.0);
    for_each_parallel(jobs.size(), threads_, [&](std::size_t i) {
      const CpuScope cpu(cpu_s[i]);
      Stopwatch watch;
      verdicts[i] = finder_->verify(*jobs[i].first, *jobs[i].second, *clouds_);
      took_ms[i] = watch.lap_ms();
    });
    timing_.server_verification_ms.insert(timing_.server_verification_ms.end(), took_ms.begin(), took_ms.end());
    for (const double s : cpu_s) load_.verification_cpu_s += s;
    return verdicts;
  }

  void receive_proxy_graph(RobotId robot, const std::string& bytes) {
    const auto message = wire::decode_proxy_graph(bytes);
    if (!message) return refusals_.push_back(message.error().message);
    robots_[robot.value]->receive(*message, time_s_);
    worst_latency_ms_[robot.value] = std::max(worst_latency_ms_[robot.value], pace_.late_ms(time_s_));
  }

  void update_map() {
    if (server_.has_news()) {
      const CpuScope cpu(load_.map_cpu_s);
      Stopwatch watch;
      const ProxyGraphMessage message = server_.optimise();
      timing_.server_optimisation_ms.push_back(watch.lap_ms());
      note_latencies(timing_.server_optimisation_ms.back());
      proxy_graph_ = message.graph;
      const auto bytes = std::make_shared<const std::string>(wire::encode(message));
      for (const auto& robot : robots_)
        send(bus::Endpoint::server(), bus::Endpoint::of(robot->id()), wire::MessageKind::proxy_graph, bytes);
      note_update();
      server_latency_ms_ = std::max(server_latency_ms_, pace_.late_ms(time_s_));
    }
    if (options_.progress)
      options_.progress(
          {time_s_, duration_s_, server_.state().submaps.size(), accepted_closures(), server_.map().components});
  }

  void note_update() {
    std::vector<const MissionRecording*> recordings;
    for (const MissionRecording& recording : recordings_) recordings.push_back(&recording);
    const auto check = check_closures(server_.map(), recordings, config_.association);
    map_updates_.push_back({time_s_, accepted_closures(), check ? std::optional(check->wrong) : std::nullopt});
  }

  [[nodiscard]] std::size_t accepted_closures() const {
    return static_cast<std::size_t>(std::count_if(server_.map().closures.begin(), server_.map().closures.end(),
                                                  [](const server::JudgedClosure& c) { return c.accepted; }));
  }

  /// Of the submaps that the update now ready is the first to contain. A lone core verifies a submap's pairs while it
  /// waits for the next update.
  void note_latencies(double update_ms) {
    for (const Unanswered& submap : unanswered_)
      load_.update_latency_ms.push_back(1e3 * std::max(time_s_ - submap.arrived_s, submap.verification_cpu_s) +
                                        update_ms);
    unanswered_.clear();
  }

  void record_traffic(RobotRecord& robot) const;
  void record_timing(MissionRecord& record) const;

  const MissionConfig& config_;
  const RunOptions& options_;
  std::vector<MissionRecording> recordings_;
  std::shared_ptr<const PointCloud> survey_;
  std::shared_ptr<const server::ClosureFinder> finder_;
  std::shared_ptr<server::CloudStore> clouds_;
  server::MapServer server_;
  bus::SimulatedRadio radio_;
  std::size_t threads_;
  Pace pace_;
  std::vector<std::unique_ptr<RobotActor>> robots_;  // by RobotId
  double time_s_ = 0.0;
  double duration_s_ = 0.0;
  ProxyGraph proxy_graph_;  // the last broadcast
  std::vector<MapUpdateRecord> map_updates_;
  std::vector<std::string> refusals_;
  std::set<SubmapPair> unreadable_;  // pairs that had an error instead of a verdict
  TimingRecord timing_;
  struct Unanswered {
    double arrived_s = 0.0;
    double verification_cpu_s = 0.0;
  };
  std::vector<Unanswered> unanswered_;  // submaps that no broadcast contains yet
  ServerLoadRecord load_;
  double server_latency_ms_ = 0.0;
  std::vector<double> worst_latency_ms_;  // of each robot's updates
};

void MissionRun::record_traffic(RobotRecord& robot) const {
  for (const auto& [topic, statistics] : radio_.statistics()) {
    const auto& [from, to, kind] = topic;
    const bool up = from.robot() == robot.id;
    if (!up && to.robot() != robot.id) continue;
    (up ? robot.bytes_up : robot.bytes_down) += statistics.published_bytes;
    (up ? robot.messages_up : robot.messages_down) += statistics.published;
    robot.traffic.push_back({.from = up ? robot.name : "server",
                             .to = up ? "server" : robot.name,
                             .kind = wire::name(kind),
                             .messages = statistics.published,
                             .bytes = statistics.published_bytes,
                             .transmitted_bytes = statistics.transmitted_bytes,
                             .bytes_per_s = robot.duration_s > 0.0
                                                ? static_cast<double>(statistics.published_bytes) / robot.duration_s
                                                : 0.0,
                             .largest_message = statistics.largest_message});
  }
}

void MissionRun::record_timing(MissionRecord& record) const {
  record.timing = timing_;
  record.timing.machine = machine_description();
  record.timing.wall_s = pace_.wall_s();
  record.timing.rate = options_.rate;
  for (const auto& robot : robots_)
    for (PolicyTiming& policy : robot->timing()) record.timing.policies.push_back(std::move(policy));
  record.timing.server_load = load_;
  record.timing.server_load.mission_s = duration_s_;
  record.timing.server_load.peak_memory_mb = peak_memory_mb();
  if (!options_.rate) return;
  for (const auto& robot : robots_)
    record.timing.load.push_back({robot->recording().recording.name, robot->cpu_s() / record.timing.wall_s,
                                  worst_latency_ms_[robot->id().value]});
  record.timing.load.push_back(
      {"server", (load_.map_cpu_s + load_.verification_cpu_s) / record.timing.wall_s, server_latency_ms_});
}

MissionRecord MissionRun::record() const {
  MissionRecord record{.mission = config_.mission,
                       .description = config_.description,
                       .input = config_.input,
                       .notes = config_.notes,
                       .seed = options_.seed,
                       .default_policy = config_.agent.policy.name,
                       .duration_s = duration_s_,
                       .association = config_.association,
                       .rpe_interval = fmt::format("{:g} s", kRpeInterval_s),
                       .version = options_.version,
                       .effective_config_yaml = to_yaml(dump_config(config_)),
                       .survey = survey_};
  std::vector<RobotOutcome> outcomes;
  for (const auto& robot : robots_) {
    outcomes.push_back(robot->outcome());
    record.notes.insert(record.notes.end(), robot->recording().notes.begin(), robot->recording().notes.end());
    for (std::string& trouble : robot->troubles()) record.notes.push_back(std::move(trouble));
  }
  if (!refusals_.empty())
    record.notes.push_back(
        fmt::format("{} messages were refused, the first because: {}", refusals_.size(), refusals_.front()));
  record.robots.resize(robots_.size());
  evaluate_robots(outcomes, server_.map(), config_.association, record);
  note_undelivered(radio_.undelivered(), record);
  note_what_the_map_lacks(server_.map(), record);
  evaluate_server(outcomes, server_, config_.association, record);
  record.server.proxy = proxy_graph_;
  record.server.updates = map_updates_;
  for (RobotRecord& robot : record.robots) {
    record_traffic(robot);
    robot.updates = robots_[robot.id.value]->updates();
    robot.alerts = follow_alerts(robot.updates);
    robot.explanation = robots_[robot.id.value]->explanation();
    robot.proxy_nodes =
        static_cast<std::size_t>(std::count_if(proxy_graph_.nodes.begin(), proxy_graph_.nodes.end(),
                                               [&](const ProxyNode& node) { return node.chain.robot == robot.id; }));
    for (const auto& [id, submap] : server_.state().submaps) robot.submaps += id.chain.robot == robot.id ? 1 : 0;
  }
  record.warnings = warnings_of(record);
  record_timing(record);
  return record;
}

Result<std::shared_ptr<server::CloudStore>> open_cloud_store(const MissionConfig& config, const RunOptions& options) {
  if (options.clouds.empty()) return std::make_shared<server::MemoryCloudStore>();
  return DiskCloudStore::open(options.clouds, {.voxel_m = config.agent.submap.voxel_m});
}

/// A radio for a robot that is not there would silently do nothing.
Status check_links(const MissionConfig& config, const std::vector<MissionRecording>& robots) {
  for (const RobotLinkConfig& own : config.robot_links)
    if (std::ranges::none_of(robots, [&](const MissionRecording& r) { return r.recording.name == own.robot; }))
      return fail(ErrorCode::configuration, "robot_links: no robot is called '{}'", own.robot);
  return {};
}

}  // namespace

Result<MissionRecord> run_mission(const MissionConfig& config, const RunOptions& options) {
  auto input = load_input(config, options.data, options.seed);
  if (!input) return tl::unexpected(input.error());
  if (const auto ok = check_links(config, input->robots); !ok) return tl::unexpected(ok.error());
  auto clouds = open_cloud_store(config, options);
  if (!clouds) return tl::unexpected(clouds.error());
  MissionRun mission(config, options, std::move(*input), std::move(*clouds));
  mission.run();
  if (const auto ok = mission.check_scans(); !ok) return tl::unexpected(ok.error());
  return mission.record();
}

}  // namespace tutti::mission
