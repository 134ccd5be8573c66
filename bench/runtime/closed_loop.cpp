// SPDX-License-Identifier: BSD-3-Clause
// A robot corrected by a server over a whole simulated corridor mission: constraints added and agreement reached, per
// policy. This is how the default thresholds of `spectral` were found (docs/math.md). Usage, every setting of
// ClosedLoopConfig by name:
//   bench_closed_loop length=1295 policy.threshold_small_m=0.02 competitors=true
#include "support/consistency/closed_loop.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "tutti/base/config_io.hpp"
#include "tutti/lab/policies.hpp"

namespace {

using namespace tutti;
using namespace tutti::consistency;

struct ClosedLoopConfig {
  int length = 1295;
  int seeds = 2;
  int nodes_per_update = 7;
  bool late_closures = false;
  bool settling = false;
  bool competitors = false;
  double odometry_translation_m = test::OdometryNoise{}.translation_m;
  double odometry_rotation_rad = test::OdometryNoise{}.rotation_rad;
  double yaw_bias_deg = 0.0;
  double scale_bias = 0.0;
  double server_smooth_m = test::ServerNoise{}.smooth_m;
  double server_local_m = test::ServerNoise{}.local_m;
  double server_local_rad = test::ServerNoise{}.local_rad;
  CompareConfig compare;
  PolicyConfig policy{.name = "spectral"};
  ProxyGraphConfig proxy_graph;
  template <class V>
  void describe(V& v) {
    v.field("length", length, at_least(2), "Nodes, one per metre.");
    v.field("seeds", seeds, at_least(1), "Runs.");
    v.field("nodes_per_update", nodes_per_update, at_least(1), "New nodes per broadcast.");
    v.field("late_closures", late_closures, any(), "The server learns of a stretch only when it is revisited.");
    v.field("settling", settling, any(), "The server comes to its final map bit by bit.");
    v.field("competitors", competitors, any(), "Also the other policies, at this one's number of constraints.");
    v.field("odometry_translation_m", odometry_translation_m, at_least(0), "Random walk per root metre.");
    v.field("odometry_rotation_rad", odometry_rotation_rad, at_least(0), "Random walk per root metre.");
    v.field("yaw_bias_deg", yaw_bias_deg, any(), "Per metre.");
    v.field("scale_bias", scale_bias, any(), "Share of the distance.");
    v.field("server_smooth_m", server_smooth_m, at_least(0), "Slow error of the server's map.");
    v.field("server_local_m", server_local_m, at_least(0), "Error of single nodes of the server's map.");
    v.field("server_local_rad", server_local_rad, at_least(0), "Same, rotation.");
    v.field("compare", compare);
    v.field("policy", policy);
    v.field("proxy_graph", proxy_graph);
  }
};

void run(const ClosedLoopConfig& config, std::uint64_t seed) {
  const test::OdometryNoise noise{config.odometry_translation_m, config.odometry_rotation_rad,
                                  config.yaw_bias_deg * std::numbers::pi / 180.0, config.scale_bias};
  const test::ServerNoise server{config.server_smooth_m, config.server_local_m, config.server_local_rad};
  auto mission = test::corridor_mission(static_cast<std::size_t>(config.length), noise, seed, server);
  mission.late_closures = config.late_closures;
  mission.settling = config.settling;
  test::LoopConfig loop{
      config.compare, config.policy, config.proxy_graph, static_cast<std::size_t>(config.nodes_per_update), {}};
  const auto row = [&](const std::string& policy) {
    const auto r = test::run_closed_loop(mission, loop);
    fmt::print("{:5} {:14} {:8.3f} {:9.3f} {:9.3f} {:9.3f} {:7} {:8}\n", seed, policy, r.onboard_m, r.corrected_m,
               r.agreement_m, r.worst_agreement_m, r.constraints, r.replaced);
    std::fflush(stdout);
    return r;
  };
  const auto first = row(config.policy.name);
  if (!config.competitors) return;
  robot::AgentConfig agent;
  agent.compare = config.compare;
  for (const char* name : {"every_node", "every_node_2", "uniform", "random", "skeleton"}) {
    const auto policy = lab::make_policy(name, agent, Rng(seed));
    auto* const spends = dynamic_cast<lab::BudgetedPolicy*>(policy->get());
    loop.other_policy = [&](std::size_t update) -> const ConstraintPolicy& {
      if (spends) spends->set_budget(first.ledger_sizes[update]);
      return **policy;
    };
    row(name);
  }
}

}  // namespace

int main(int argc, char** argv) {
  ConfigNode node{.kind = ConfigNode::Kind::map};
  ClosedLoopConfig config;
  for (int i = 1; i < argc; ++i)
    if (const auto status = apply_override(node, argv[i]); !status)
      return fmt::print("{}\n", status.error().message), 2;
  if (const auto status = load_config(node, config, "command line"); !status)
    return fmt::print("{}\n", status.error().message), 2;
  fmt::print(" seed policy          onboard corrected agreement     worst   links replaced\n");
  for (int seed = 1; seed <= config.seeds; ++seed) run(config, static_cast<std::uint64_t>(seed));
}
