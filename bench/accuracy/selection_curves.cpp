// SPDX-License-Identifier: BSD-3-Clause
// One comparison at the end of a mission: the server makes its map of everything at once, then every policy answers the
// same proxy graph with every budget, each from raw odometry. One JSON object per line: scenario, seed, robot, policy,
// budget and what came of it. bench/accuracy/selection.py runs it over scenarios and seeds.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tutti/evaluation/agreement.hpp"
#include "tutti/evaluation/ate.hpp"
#include "tutti/evaluation/kink.hpp"
#include "tutti/evaluation/rpe.hpp"
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

Errors errors_of(const Trajectory& estimate, const mission::MissionRecording& robot,
                 const evaluation::AssociationConfig& association) {
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

json to_json(const Errors& e) {
  return {{"rmse_m", e.rmse_m}, {"max_m", e.max_m}, {"rpe_1s_m", e.rpe_m}, {"rpe_10m_m", e.rpe_10m_m}};
}

robot::RobotAgent replayed(const mission::MissionRecording& robot, robot::AgentConfig config, const std::string& policy,
                           std::uint64_t seed) {
  config.policy.name = policy;
  robot::RobotAgent agent(robot.recording.robot, 1, config, Rng(seed).fork(policy));
  const Recording& recording = robot.recording;
  for (std::size_t k = 0; k < recording.odometry.size(); ++k) {
    const Matrix6d covariance = k == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[k - 1];
    (void)agent.add_odometry(recording.odometry[k].stamp, recording.odometry[k].pose, covariance);
  }
  agent.finish();
  return agent;
}

/// The map of the whole mission, made at once.
ProxyGraphMessage final_map(const mission::MissionConfig& config, const std::vector<mission::MissionRecording>& robots,
                            std::uint64_t seed, server::MapEstimate& map) {
  std::set<RobotId> ids;
  for (const auto& robot : robots) ids.insert(robot.recording.robot);
  const auto finder = mission::make_closure_finder(config.closures, robots, seed);
  auto clouds = std::make_shared<server::MemoryCloudStore>();
  server::MapServer server(ids, finder, clouds, config.server);
  for (const auto& robot : robots) {
    auto agent = replayed(robot, config.agent, "none", seed);
    for (const SubmapMessage& message : agent.take_outgoing())
      (void)server.receive(*wire::decode_submap(wire::encode(message)));
  }
  for (const auto& job : server.take_jobs())
    if (const auto verdict = finder->verify(*job.first, *job.second, *clouds)) (void)server.receive(*verdict);
  const ProxyGraphMessage message = server.optimise();
  map = server.map();
  return *wire::decode_proxy_graph(wire::encode(message));
}

Trajectory server_estimate(const server::MapEstimate& map, RobotId robot) {
  Trajectory out;
  for (const auto& node : map.nodes)
    if (node.id.robot == robot) out.push_back({node.stamp, node.T_world_body});
  return out;
}

Trajectory keyframe_odometry(const robot::RobotAgent& agent) {
  Trajectory out;
  for (const Keyframe& k : agent.keyframes()) out.push_back({k.stamp, k.T_odom_body});
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Budget curves: every policy answers the same final proxy graph with every budget.");
  std::string file, data, label;
  std::vector<std::string> assignments, policies{"adaptive"};
  std::vector<int> budgets{0};
  std::uint64_t seed = 1;
  app.add_option("mission", file, "Mission file")->required();
  app.add_option("--data", data, "Folder of real recordings");
  app.add_option("--seed", seed, "Seed");
  app.add_option("--label", label, "Name in the output; default: the mission's");
  app.add_option("--set", assignments, "key=value")->allow_extra_args(false);
  app.add_option("--policies", policies, "Policies")->delimiter(',');
  app.add_option("--budgets", budgets, "Budgets; 0 = the policy's own rule")->delimiter(',');
  CLI11_PARSE(app, argc, argv);

  const auto config = mission::load_mission(file, assignments);
  if (!config) return std::fprintf(stderr, "%s\n", config.error().message.c_str()), 1;
  const auto input = mission::load_input(*config, data, seed);
  if (!input) return std::fprintf(stderr, "%s\n", input.error().message.c_str()), 1;
  server::MapEstimate map;
  const ProxyGraphMessage broadcast = final_map(*config, input->robots, seed, map);

  for (const auto& robot : input->robots) {
    const auto raw = replayed(robot, config->agent, "none", seed);
    const Errors onboard = errors_of(keyframe_odometry(raw), robot, config->association);
    const Errors server = errors_of(server_estimate(map, robot.recording.robot), robot, config->association);
    json base{{"mission", label.empty() ? config->mission : label},
              {"seed", seed},
              {"robot", robot.recording.name},
              {"odometry_factors", raw.odometry_factors()},
              {"onboard", to_json(onboard)},
              {"server", to_json(server)}};
    for (const ShapeUncertainty& shape : broadcast.graph.shapes)
      if (shape.robot == robot.recording.robot) base["expected_rmse_m"] = shape.whole.position_m;
    for (const DriftOrigin& origin : robot.recording.drift_origins)
      base["true_origins"].push_back({{"from_s", origin.from - robot.recording.odometry.front().stamp},
                                      {"until_s", origin.until - robot.recording.odometry.front().stamp},
                                      {"translation_m", origin.translation_m},
                                      {"rotation_rad", origin.rotation_rad}});
    for (const std::string& policy : policies)
      for (const int budget : budgets) {
        auto agent = replayed(robot, config->agent, policy, seed);
        const auto summary = agent.receive(
            broadcast, budget > 0 ? std::optional<std::size_t>(static_cast<std::size_t>(budget)) : std::nullopt);
        json line = base;
        line["policy"] = policy;
        line["budget"] = budget;
        line["nodes"] = summary.synchronised;
        line["constraints"] = summary.constraints;
        line["corrected"] = to_json(errors_of(agent.corrected(), robot, config->association));
        line["disagrees"] = summary.explanation.disagrees();
        for (const auto& origin : summary.explanation.origins)
          line["origins"].push_back({{"from_s", origin.from - robot.recording.odometry.front().stamp},
                                     {"until_s", origin.until - robot.recording.odometry.front().stamp},
                                     {"scale", origin.scale},
                                     {"translation_m", origin.translation_m},
                                     {"rotation_rad", origin.rotation_rad},
                                     {"significance", origin.significance},
                                     {"alert", origin.alert}});
        if (const auto agreement =
                evaluation::agreement(agent.corrected(), server_estimate(map, robot.recording.robot)))
          line["agreement_m"] = agreement->rmse_m;
        if (const auto kink = evaluation::kink(keyframe_odometry(raw), agent.corrected(), 1.0))
          line["kink_m"] = kink->translation_m;
        std::printf("%s\n", line.dump().c_str());
      }
  }
  return 0;
}
