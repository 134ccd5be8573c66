// SPDX-License-Identifier: BSD-3-Clause
// One comparison at the end of a mission: the server makes its map of everything at once, then every policy answers the
// same proxy graph with every budget, each from raw odometry. With --closed-loop the mission runs in the order of time
// instead and every policy answers every update of the map; there is no radio, so nothing is late or lost. One JSON
// object per line: mission, seed, robot, policy, budget or time, and what came of it. bench/accuracy/selection.py runs
// it over scenarios and seeds.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tutti/evaluation/agreement.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/kink.hpp"
#include "tutti/evaluation/rpe.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/mission/closure_finders.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/wire/codec.hpp"

namespace {

using namespace tutti;
using nlohmann::json;

struct Errors {
  double rmse_m = 0.0, max_m = 0.0, rpe_m = 0.0, rpe_10m_m = 0.0;
};

/// Nothing when the robot has no reference to be scored against.
std::optional<Errors> errors_of(const Trajectory& estimate, const mission::MissionRecording& robot,
                                const evaluation::AssociationConfig& association) {
  if (!robot.score_against_reference) return std::nullopt;
  const auto pairs = evaluation::associate(estimate, robot.recording.reference, association);
  Errors out;
  if (const auto ate = evaluation::ate(pairs)) {
    out.rmse_m = ate->rmse_m;
    out.max_m = ate->max_m;
  }
  if (const auto rpe = evaluation::rpe_over_time(pairs, 1.0)) out.rpe_m = rpe->rmse_m;
  if (const auto rpe = evaluation::rpe_over_distance(pairs, 10.0)) out.rpe_10m_m = rpe->rmse_m;
  return out;
}

json to_json(const std::optional<Errors>& e) {
  if (!e) return nullptr;
  return {{"rmse_m", e->rmse_m}, {"max_m", e->max_m}, {"rpe_1s_m", e->rpe_m}, {"rpe_10m_m", e->rpe_10m_m}};
}

/// A robot's agent and how far its recording has been replayed into it.
class Replay {
 public:
  Replay(const mission::MissionRecording& robot, robot::AgentConfig config, const std::string& policy,
         std::uint64_t seed)
      : robot_(robot), agent_(robot.recording.robot, 0, named(config, policy), Rng(seed).fork(policy)) {}

  /// Everything up to this mission time; `with_scans` for the one whose submaps the server gets.
  void until(double time_s, bool with_scans) {
    const Recording& recording = robot_.recording;
    const std::size_t size = recording.odometry.size();
    for (; next_ < size && start_s(next_) <= time_s; ++next_) {
      const Matrix6d covariance = next_ == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[next_ - 1];
      (void)agent_.add_odometry(recording.odometry[next_].stamp, recording.odometry[next_].pose, covariance);
      if (with_scans && recording.scans && agent_.wants_scan())
        if (const auto scan = recording.scans->scan(next_); scan && *scan) (void)agent_.add_scan(**scan);
      if (next_ + 1 == size) agent_.finish();
    }
  }
  [[nodiscard]] bool done() const { return next_ == robot_.recording.odometry.size(); }
  [[nodiscard]] robot::RobotAgent& agent() { return agent_; }

 private:
  static const robot::AgentConfig& named(robot::AgentConfig& config, const std::string& policy) {
    config.policy.name = policy;
    return config;
  }
  [[nodiscard]] double start_s(std::size_t k) const {
    const Trajectory& odometry = robot_.recording.odometry;
    return robot_.start_s + (odometry[k].stamp - odometry.front().stamp);
  }

  const mission::MissionRecording& robot_;
  robot::RobotAgent agent_;
  std::size_t next_ = 0;
};

constexpr double kEnd = std::numeric_limits<double>::infinity();

robot::RobotAgent replayed(const mission::MissionRecording& robot, const robot::AgentConfig& config,
                           const std::string& policy, std::uint64_t seed) {
  Replay replay(robot, config, policy, seed);
  replay.until(kEnd, false);
  return std::move(replay.agent());
}

/// The server with what it needs to find closures.
class Server {
 public:
  Server(const mission::MissionConfig& config, const std::vector<mission::MissionRecording>& robots, std::uint64_t seed)
      : voxel_m_(config.agent.submap.voxel_m),
        finder_(mission::make_closure_finder(config.closures, robots, seed)),
        clouds_(std::make_shared<server::MemoryCloudStore>()),
        server_(ids(robots), finder_, clouds_, config.server, 1) {}

  void receive(const std::vector<SubmapMessage>& messages) {
    for (const SubmapMessage& message : messages)
      (void)server_.receive(*wire::decode_submap(wire::encode(message, {.voxel_m = voxel_m_})));
  }
  void verify() {
    for (const auto& job : server_.take_jobs())
      if (const auto verdict = finder_->verify(*job.first, *job.second, *clouds_)) (void)server_.receive(*verdict);
  }
  [[nodiscard]] bool has_news() const { return server_.has_news(); }
  ProxyGraphMessage broadcast() { return *wire::decode_proxy_graph(wire::encode(server_.optimise())); }
  [[nodiscard]] const server::MapEstimate& map() const { return server_.map(); }

 private:
  static std::set<RobotId> ids(const std::vector<mission::MissionRecording>& robots) {
    std::set<RobotId> out;
    for (const auto& robot : robots) out.insert(robot.recording.robot);
    return out;
  }

  double voxel_m_;
  std::shared_ptr<const server::ClosureFinder> finder_;
  std::shared_ptr<server::CloudStore> clouds_;
  server::MapServer server_;
};

Trajectory server_estimate(const server::MapEstimate& map, RobotId robot) {
  Trajectory out;
  for (const auto& node : map.nodes)
    if (node.id.chain.robot == robot) out.push_back({node.stamp, node.T_world_body});
  return out;
}

Trajectory keyframe_odometry(const robot::RobotAgent& agent) {
  Trajectory out;
  for (const Keyframe& k : agent.keyframes()) out.push_back({k.stamp, k.T_odom_body});
  return out;
}

/// Accepted closures that are off by more than 0.5 m or 2 degrees.
std::size_t wrong_closures(const server::MapEstimate& map, const std::vector<mission::MissionRecording>& robots,
                           const evaluation::AssociationConfig& association) {
  std::map<KeyframeId, Pose3> truth;
  for (const auto& robot : robots) {
    std::map<Timestamp, KeyframeId> by_stamp;
    for (const auto& node : map.nodes)
      if (node.id.chain.robot == robot.recording.robot) by_stamp[node.stamp] = node.id;
    for (const auto& pair :
         evaluation::associate(server_estimate(map, robot.recording.robot), robot.recording.reference, association))
      truth[by_stamp.at(pair.stamp)] = pair.reference;
  }
  return static_cast<std::size_t>(std::ranges::count_if(map.closures, [&](const server::JudgedClosure& judged) {
    const auto from = truth.find(judged.closure.from);
    const auto to = truth.find(judged.closure.to);
    if (!judged.accepted || from == truth.end() || to == truth.end()) return false;
    const Vector6d error = local(from->second.inverse() * to->second, judged.closure.measurement.T_a_b);
    return error.head<3>().norm() > 0.5 || error.tail<3>().norm() > 2.0 * kRadPerDeg;
  }));
}

json origins_json(const std::vector<consistency::SuspectedOrigin>& origins, Timestamp start) {
  json out = json::array();
  for (const auto& origin : origins)
    out.push_back({{"from_s", origin.from - start},
                   {"until_s", origin.until - start},
                   {"scale", origin.scale},
                   {"translation_m", origin.translation_m},
                   {"rotation_rad", origin.rotation_rad},
                   {"significance", origin.significance},
                   {"alert", origin.alert}});
  return out;
}

json origins_json(const std::vector<DriftOrigin>& origins, Timestamp start) {
  constexpr const char* kKinds[] = {"slip", "degeneracy", "failure"};
  json out = json::array();
  for (const DriftOrigin& origin : origins)
    out.push_back({{"kind", kKinds[static_cast<int>(origin.kind)]},
                   {"from_s", origin.from - start},
                   {"until_s", origin.until - start},
                   {"translation_m", origin.translation_m},
                   {"rotation_rad", origin.rotation_rad}});
  return out;
}

struct Task {
  mission::MissionConfig config;
  std::string label;
  std::uint64_t seed = 1;
  std::vector<mission::MissionRecording> robots;
  std::vector<std::string> policies{"adaptive"};
  std::vector<int> budgets{0};
};

void print_curves(const Task& task) {
  const auto& association = task.config.association;
  Server server(task.config, task.robots, task.seed);
  for (const auto& robot : task.robots) {
    Replay replay(robot, task.config.agent, "none", task.seed);
    replay.until(kEnd, true);
    server.receive(replay.agent().take_outgoing());
  }
  server.verify();
  const ProxyGraphMessage broadcast = server.broadcast();
  for (const auto& robot : task.robots) {
    const Timestamp start = robot.recording.odometry.front().stamp;
    const auto raw = replayed(robot, task.config.agent, "none", task.seed);
    const Trajectory mapped = server_estimate(server.map(), robot.recording.robot);
    const json base{{"mission", task.label},
                    {"seed", task.seed},
                    {"robot", robot.recording.name},
                    {"odometry_factors", raw.odometry_factors()},
                    {"onboard", to_json(errors_of(keyframe_odometry(raw), robot, association))},
                    {"server", to_json(errors_of(mapped, robot, association))},
                    {"true_origins", origins_json(robot.recording.drift_origins, start)}};
    for (const std::string& policy : task.policies)
      for (const int budget : policy.starts_with("every_node") ? std::vector<int>{0} : task.budgets) {
        auto agent = replayed(robot, task.config.agent, policy, task.seed);
        const auto summary = agent.receive(
            broadcast, budget > 0 ? std::optional<std::size_t>(static_cast<std::size_t>(budget)) : std::nullopt);
        json line = base;
        line["policy"] = policy;
        line["budget"] = budget;
        line["nodes"] = summary.synchronised;
        line["constraints"] = summary.constraints;
        line["corrected"] = to_json(errors_of(agent.corrected(), robot, association));
        line["disagrees"] = summary.explanation.disagrees();
        line["origins"] = origins_json(summary.explanation.origins, start);
        if (const auto agreement = evaluation::agreement(agent.corrected(), mapped))
          line["agreement_m"] = agreement->rmse_m;
        if (const auto kink = evaluation::kink(keyframe_odometry(raw), agent.corrected()))
          line["kink_m"] = kink->translation_m;
        std::printf("%s\n", line.dump().c_str());
      }
  }
}

/// What the map already holds of a robot, so that all three estimates are of the same stretch.
Trajectory before(Trajectory trajectory, Timestamp last) {
  std::erase_if(trajectory, [&](const StampedPose& pose) { return pose.stamp > last; });
  return trajectory;
}

void print_update(const Task& task, const mission::MissionRecording& robot, const Server& server, double time_s,
                  std::size_t wrong, const std::string& policy, const robot::RobotAgent& agent,
                  const robot::UpdateSummary& summary) {
  const Trajectory mapped = server_estimate(server.map(), robot.recording.robot);
  if (mapped.empty() || summary.synchronised == 0) return;
  const auto errors = [&](const Trajectory& estimate) {
    return to_json(errors_of(before(estimate, mapped.back().stamp), robot, task.config.association));
  };
  const json line{{"mission", task.label},
                  {"seed", task.seed},
                  {"robot", robot.recording.name},
                  {"policy", policy},
                  {"time_s", time_s},
                  {"wrong_closures", wrong},
                  {"constraints", summary.constraints},
                  {"disagrees", summary.explanation.disagrees()},
                  {"onboard", errors(keyframe_odometry(agent))},
                  {"server", errors(mapped)},
                  {"corrected", errors(agent.corrected())}};
  std::printf("%s\n", line.dump().c_str());
}

void print_closed_loop(const Task& task) {
  Server server(task.config, task.robots, task.seed);
  struct Robot {
    const mission::MissionRecording* recording;
    Replay speaker;                 // whose submaps the server gets: raw odometry, as every policy would send
    std::vector<Replay> listeners;  // one per policy
  };
  std::vector<Robot> robots;
  for (const auto& recording : task.robots) {
    robots.push_back({&recording, Replay(recording, task.config.agent, "none", task.seed), {}});
    for (const std::string& policy : task.policies)
      robots.back().listeners.emplace_back(recording, task.config.agent, policy, task.seed);
  }
  bool done = false;
  for (double time_s = task.config.server.update_period_s; !done; time_s += task.config.server.update_period_s) {
    done = true;
    for (Robot& robot : robots) {
      robot.speaker.until(time_s, true);
      for (Replay& listener : robot.listeners) listener.until(time_s, false);
      server.receive(robot.speaker.agent().take_outgoing());
      done = done && robot.speaker.done();
    }
    server.verify();
    if (!server.has_news()) continue;
    const ProxyGraphMessage broadcast = server.broadcast();
    const std::size_t wrong = wrong_closures(server.map(), task.robots, task.config.association);
    for (Robot& robot : robots)
      for (std::size_t p = 0; p < task.policies.size(); ++p) {
        auto& agent = robot.listeners[p].agent();
        const auto summary = agent.receive(broadcast);
        print_update(task, *robot.recording, server, time_s, wrong, task.policies[p], agent, summary);
      }
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Every policy answers the same proxy graphs: the final one with every budget, or all in closed loop.");
  std::string file, data;
  std::vector<std::string> assignments;
  Task task;
  bool closed_loop = false;
  app.add_option("mission", file, "Mission file")->required();
  app.add_option("--data", data, "Folder of real recordings");
  app.add_option("--seed", task.seed, "Seed");
  app.add_option("--label", task.label, "Name in the output; default: the mission's");
  app.add_option("--set", assignments, "key=value")->allow_extra_args(false);
  app.add_option("--policies", task.policies, "Policies")->delimiter(',');
  app.add_option("--budgets", task.budgets, "Budgets; 0 = the policy's own rule")->delimiter(',');
  app.add_flag("--closed-loop", closed_loop, "All updates in the order of time; budgets are the policies' own");
  CLI11_PARSE(app, argc, argv);

  const auto config = mission::load_mission(file, assignments);
  if (!config) return std::fprintf(stderr, "%s\n", config.error().message.c_str()), 1;
  auto input = mission::load_input(*config, data, task.seed);
  if (!input) return std::fprintf(stderr, "%s\n", input.error().message.c_str()), 1;
  task.config = *config;
  task.robots = std::move(input->robots);
  if (task.label.empty()) task.label = config->mission;
  closed_loop ? print_closed_loop(task) : print_curves(task);
  return 0;
}
