// SPDX-License-Identifier: BSD-3-Clause
// Outlier rejection on simulated places of every scale: a room, a hall, a tunnel, a street; wrong closures strewn about
// and in groups that agree, odometry that fails, and that is three times too sure or unsure of itself. One JSON object
// per map: its error over that of a judge who knows which closures are wrong.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "support/server/corridor_run.hpp"
#include "tutti/base/config_io.hpp"

namespace {

using namespace tutti;
using server::test::CorridorRun;
using server::test::CorridorRunConfig;

struct Place {
  std::string name;
  double block_m;    ///< Between junctions.
  double speed_mps;  ///< At most.
  double duration_s;
  double odometry;  ///< Its noise, over that of a person who walks.
};

const std::vector<Place> kPlaces = {{"room", 2.5, 0.7, 150.0, 1.0},
                                    {"hall", 8.0, 1.0, 300.0, 1.0},
                                    {"tunnel", 60.0, 2.0, 900.0, 1.0},
                                    {"street", 120.0, 12.0, 600.0, 0.5}};

/// Wrong closures: strewn about, and how long the similar segments are (0: none).
struct Wrong {
  double share;
  double alike_s;
};
const std::vector<Wrong> kWrong = {{0.0, 0.0}, {0.1, 18.0}, {0.3, 0.0}, {0.1, 32.0}};

struct Case {
  Place place;
  double stated = 1.0;  ///< Odometry's stated standard deviations over the honest ones.
  bool fails = false;
  Wrong wrong{};
  std::uint64_t seed = 1;
};

CorridorRunConfig config_of(const Case& of) {
  Rng rng = Rng(of.seed).fork(of.place.name);
  const Place& place = of.place;
  CorridorRunConfig config;
  config.world = {.rows = 2, .columns = 3, .block_m = place.block_m, .jitter_m = place.block_m / 5.0};
  config.walk = {.duration_s = place.duration_s,
                 .rate_hz = 4.0,
                 .min_speed_mps = 0.6 * place.speed_mps,
                 .max_speed_mps = place.speed_mps,
                 .lookahead_m = std::clamp(place.block_m / 6.0, 0.3, 6.0)};
  config.keyframe_m = 0.8 * place.speed_mps;
  config.odometry.translation_m_per_sqrt_m *= place.odometry;
  config.odometry.yaw_deg_per_sqrt_m *= place.odometry;
  config.odometry.stated_sigma_factor = of.stated;
  config.closures = {.radius_m = std::min(4.0, 2.0 * place.speed_mps), .wrong_share = of.wrong.share};
  if (of.fails) {
    const double at_s = rng.uniform(0.4, 0.7) * place.duration_s;
    config.failures = {server::test::failure(0, at_s, at_s + rng.uniform(0.0, 20.0), place.speed_mps, place.speed_mps,
                                             rng.uniform(5.0, 25.0))};
  }
  if (of.wrong.alike_s > 0.0)
    config.look_alikes = {{.first = {0},
                           .first_from_s = rng.uniform(0.1, 0.3) * place.duration_s,
                           .second = {1},
                           .second_from_s = rng.uniform(0.5, 0.75) * place.duration_s,
                           .length_s = of.wrong.alike_s}};
  return config;
}

/// The map of a judge who knows which closures are wrong.
server::MapEstimate perfect_map(CorridorRun run, const server::MapConfig& config) {
  DecisionSet decisions;
  for (auto& [pair, verdict] : run.verdicts) {
    std::erase_if(verdict.closures, [&](const LoopClosure& c) { return server::test::is_wrong(run, c); });
    if (!verdict.closures.empty()) decisions[pair] = {.closure = {}, .wish = Wish::accept, .by = "truth"};
  }
  return server::estimate_map(run.submaps, run.verdicts, config, decisions);
}

nlohmann::json judged(const Case& of, const server::MapConfig& config) {
  const CorridorRun run = server::test::corridor_run(config_of(of), of.seed);
  const auto before = std::chrono::steady_clock::now();
  const server::MapEstimate map = server::estimate_map(run.submaps, run.verdicts, config);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  std::size_t right = 0, kept = 0, wrong_kept = 0;
  for (const server::JudgedClosure& closure : map.closures) {
    const bool wrong = server::test::is_wrong(run, closure.closure);
    right += wrong ? 0U : 1U;
    kept += !wrong && closure.accepted ? 1U : 0U;
    wrong_kept += wrong && closure.accepted ? 1U : 0U;
  }
  return {{"place", of.place.name},
          {"stated", of.stated},
          {"fails", of.fails},
          {"wrong_share", of.wrong.share},
          {"alike_s", of.wrong.alike_s},
          {"seed", of.seed},
          {"rmse_m", server::test::rmse(run, map)},
          {"perfect_rmse_m", server::test::rmse(run, perfect_map(run, config))},
          {"right", right},
          {"wrong", map.closures.size() - right},
          {"right_accepted", kept},
          {"wrong_accepted", wrong_kept},
          {"failures", map.failed_odometry.size()},
          {"seconds", seconds}};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Outlier rejection on simulated places of every scale.");
  std::uint64_t seeds = 1;
  std::vector<std::string> assignments;
  std::string only;
  app.add_option("--seeds", seeds, "Seeds of every case");
  app.add_option("--place", only, "Only this one: room, hall, tunnel or street");
  app.add_option("--set", assignments, "key=value of server.map")->allow_extra_args(false);
  CLI11_PARSE(app, argc, argv);
  ConfigNode node;
  node.kind = ConfigNode::Kind::map;
  for (const std::string& assignment : assignments)
    if (const auto status = apply_override(node, assignment); !status)
      return std::fprintf(stderr, "%s\n", status.error().message.c_str()), 1;
  server::MapConfig config;
  if (const auto status = load_config(node, config, "--set"); !status)
    return std::fprintf(stderr, "%s\n", status.error().message.c_str()), 1;
  for (const Place& place : kPlaces) {
    if (!only.empty() && only != place.name) continue;
    for (std::uint64_t seed = 1; seed <= seeds; ++seed)
      for (const double stated : {1.0 / 3.0, 1.0, 3.0})
        for (const bool fails : {false, true})
          for (const Wrong& wrong : kWrong) {
            std::printf("%s\n", judged({place, stated, fails, wrong, seed}, config).dump().c_str());
            std::fflush(stdout);
          }
  }
  return 0;
}
