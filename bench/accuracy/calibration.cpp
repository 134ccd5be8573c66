// SPDX-License-Identifier: BSD-3-Clause
// How often a robot that is off by no more than the map itself may be is found to disagree: a mission runs in the
// order of time, without a radio; at every tenth update of the map, draws of the map's own posterior, with other random
// numbers than the server's, take the robot's place in its test. One JSON object per robot and update.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <limits>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "tutti/consistency/disagreement.hpp"
#include "tutti/estimation/marginals.hpp"
#include "tutti/lab/closure_verifiers.hpp"
#include "tutti/lab/mission_config.hpp"
#include "tutti/lab/mission_input.hpp"
#include "tutti/robot/agent.hpp"
#include "tutti/server/map_server.hpp"
#include "tutti/wire/codec.hpp"

namespace {

using namespace tutti;

constexpr double kUpdate_s = 10.0;  // of mission time, between two maps

/// The test that a robot makes of a broadcast, all of whose nodes of this chain it has.
consistency::DisagreementTest robots_test(const ProxyGraph& graph, const ChainId& chain, double alpha) {
  std::vector<consistency::NodePair> pairs;
  for (std::size_t i = 0; i < graph.nodes.size(); ++i)
    if (graph.nodes[i].chain == chain) pairs.push_back({.proxy = i, .robot = pairs.size()});
  return {graph, chain, pairs, {.false_alarm_rate = alpha}};
}

/// Draws of these nodes' errors (right tangents): (6 nodes) x count, other draws than the server's own.
Eigen::MatrixXd normal_draws(const server::MapEstimate& map, const std::vector<std::size_t>& nodes, std::size_t count,
                             Rng rng) {
  std::vector<double> weights(map.graph.edges.size(), 1.0);
  for (std::size_t e = 0; e < map.odometry_edges; ++e)
    if (const auto factor = map.overstated.find(map.nodes[map.graph.edges[e].from].id.chain);
        factor != map.overstated.end())
      weights[e] = 1.0 / factor->second;
  return estimation::JointPosterior(map.graph, map.graph.poses, {}, weights).samples(nodes, count, rng.fork("draws"));
}

struct Options {
  std::string mission, data;
  std::vector<std::string> assignments;
  std::uint64_t seed = 1;
  std::size_t draws = 200;
  std::size_t every = 10;
  double alpha = 0.01;
};

/// Every chain of the broadcast that is long enough to be tested.
void judge(const Options& options, std::size_t update, const server::MapEstimate& map, const ProxyGraph& graph,
           const std::map<RobotId, std::string>& names) {
  std::map<std::pair<ChainId, Timestamp>, std::size_t> index;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) index[{map.nodes[i].id.chain, map.nodes[i].stamp}] = i;
  std::map<ChainId, std::vector<std::size_t>> chains;
  for (const ProxyNode& node : graph.nodes) chains[node.chain].push_back(index.at({node.chain, node.stamp}));
  for (const auto& [chain, nodes] : chains) {
    if (nodes.size() < 2) continue;
    const Eigen::MatrixXd draws =
        normal_draws(map, nodes, options.draws, Rng(options.seed).fork("calibration").fork(update));
    if (!draws.allFinite()) continue;
    const auto test = robots_test(graph, chain, options.alpha);
    std::size_t rejected = 0;
    for (Eigen::Index d = 0; d < draws.cols(); ++d) {
      std::vector<Pose3> robot;
      for (std::size_t k = 0; k < nodes.size(); ++k)
        robot.push_back(
            retract(map.nodes[nodes[k]].T_world_body, draws.col(d).segment<6>(static_cast<Eigen::Index>(6 * k))));
      rejected += test(robot).disagrees() ? 1U : 0U;
    }
    const nlohmann::json line{{"robot", names.at(chain.robot)},
                              {"update", update},
                              {"nodes", nodes.size()},
                              {"draws", options.draws},
                              {"rejected", rejected}};
    std::printf("%s\n", line.dump().c_str());
  }
}

/// A robot's agent, of which only submaps are wanted, and how far its recording has been replayed into it.
class Speaker {
 public:
  Speaker(const mission::MissionRecording& robot, robot::AgentConfig config) : robot_(robot), agent_(make(config)) {}

  /// Everything up to this mission time; the submaps that it made.
  std::vector<SubmapMessage> until(double time_s) {
    const Recording& recording = robot_.recording;
    for (; !done() && start_s() <= time_s; ++next_) {
      const Matrix6d covariance = next_ == 0 ? Matrix6d(Matrix6d::Zero()) : recording.increment_covariance[next_ - 1];
      (void)agent_.add(OdometrySample{recording.odometry[next_].stamp, recording.odometry[next_].pose, covariance});
      if (recording.scans && agent_.wants_scan())
        if (const auto scan = recording.scans->scan(next_); scan && *scan) (void)agent_.add(**scan);
      if (next_ + 1 == recording.odometry.size()) agent_.finish();
    }
    return agent_.take_outgoing();
  }
  [[nodiscard]] bool done() const { return next_ == robot_.recording.odometry.size(); }

 private:
  robot::RobotAgent make(robot::AgentConfig& config) const {
    config.policy.name = "none";
    return {robot_.recording.robot, 0, config};
  }
  [[nodiscard]] double start_s() const {
    return robot_.start_s + (robot_.recording.odometry[next_].stamp - robot_.recording.odometry.front().stamp);
  }

  const mission::MissionRecording& robot_;
  robot::RobotAgent agent_;
  std::size_t next_ = 0;
};

void run(const Options& options, const lab::MissionConfig& config,
         const std::vector<mission::MissionRecording>& robots) {
  std::map<RobotId, std::string> names;
  std::set<RobotId> ids;
  std::vector<Speaker> speakers;
  for (const auto& robot : robots) {
    names[robot.recording.robot] = robot.recording.name;
    ids.insert(robot.recording.robot);
    speakers.emplace_back(robot, config.agent);
  }
  const auto verifier = lab::make_closure_verifier(config, robots, options.seed);
  const auto clouds = std::make_shared<server::MemoryPayloadStore>();
  server::MapServer server(ids, verifier, clouds, config.server, 1);
  std::size_t update = 0;
  const double end_s = config.duration_s > 0.0 ? config.duration_s : std::numeric_limits<double>::infinity();
  bool done = false;
  for (double time_s = kUpdate_s; !done && time_s <= end_s; time_s += kUpdate_s) {
    done = true;
    for (Speaker& speaker : speakers) {
      for (const SubmapMessage& message : speaker.until(time_s))
        (void)server.receive(*wire::decode_submap(wire::encode(message, {.voxel_m = config.agent.submap.voxel_m})));
      done = done && speaker.done();
    }
    for (const auto& job : server.take_jobs())
      if (const auto verdict = verifier->verify(*job.first, *job.second, *clouds)) (void)server.receive(*verdict);
    if (!server.has_news()) continue;
    const ProxyGraphMessage broadcast = *wire::decode_proxy_graph(wire::encode(server.optimise()));
    if (++update % options.every == 0 || done) judge(options, update, server.map(), broadcast.graph, names);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Draws of the map's own posterior through the robot's test of disagreement.");
  Options options;
  app.add_option("mission", options.mission, "Mission file")->required();
  app.add_option("--data", options.data, "Folder of real recordings");
  app.add_option("--seed", options.seed, "Seed");
  app.add_option("--set", options.assignments, "key=value")->allow_extra_args(false);
  app.add_option("--draws", options.draws, "Draws per robot and update");
  app.add_option("--every", options.every, "Every so many updates, and the last");
  app.add_option("--alpha", options.alpha, "False-alarm rate of one look");
  CLI11_PARSE(app, argc, argv);

  const auto config = lab::load_mission(options.mission, options.assignments);
  if (!config) return std::fprintf(stderr, "%s\n", config.error().message.c_str()), 1;
  const auto input = lab::load_input(*config, options.data, options.seed);
  if (!input) return std::fprintf(stderr, "%s\n", input.error().message.c_str()), 1;
  run(options, *config, input->robots);
  return 0;
}
