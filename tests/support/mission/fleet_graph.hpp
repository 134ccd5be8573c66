// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cstdint>
#include <map>
#include <utility>

#include "support/server/corridor_run.hpp"
#include "tutti/formats/pyfg.hpp"

namespace tutti::mission::fleets {

/// Three simulated robots in the shape of a real fleet of COSMO-Bench: stamps since 1970, poses 1.3 s apart, robots
/// that begin some seconds one after the other, the truth as vertices; one closure in ten is wrong. A closure within a
/// robot arrives with its later pose, one between robots 1.2 s later, and where the radio had no contact after minutes.
inline formats::PyfgFile fleet_graph(std::uint64_t seed, double duration_s = 240.0) {
  constexpr std::int64_t kEpoch_ns = 1'670'403'892'357'527'971;
  server::test::CorridorRunConfig config{.robots = 3,
                                         .walk = {.duration_s = duration_s, .rate_hz = 4.0},
                                         .closures = {.radius_m = 2.0, .wrong_share = 0.1},
                                         .keyframe_m = 1.2};
  config.odometry.translation_m_per_sqrt_m = 0.03;
  config.odometry.yaw_deg_per_sqrt_m = 0.3;
  const server::test::CorridorRun run = server::test::corridor_run(config, seed);
  formats::PyfgFile file;
  std::map<KeyframeId, std::size_t> place;
  const auto vertex_of = [&](const SubmapId& submap, const Keyframe& keyframe) {
    const KeyframeId id{submap.chain, keyframe.index};
    const auto [at, is_new] = place.try_emplace(id, file.vertices.size());
    if (is_new)
      file.vertices.push_back({.name = {static_cast<char>('a' + submap.chain.robot.value), keyframe.index},
                               .stamp = {kEpoch_ns + keyframe.stamp.ns + 7'000'000'000LL * submap.chain.robot.value},
                               .pose = run.true_poses.at(id),
                               .prior = {}});
    return at->second;
  };
  for (const auto& [id, submap] : run.submaps)
    for (std::size_t k = 0; k < submap->keyframes.size(); ++k) {
      const std::size_t to = vertex_of(id, submap->keyframes[k]);
      if (k > 0) file.edges.push_back({file.vertices[to].stamp, to - 1, to, submap->odometry[k - 1]});
    }
  Rng rng = Rng(seed).fork("radio");
  for (const auto& [pair, verdict] : run.verdicts)
    for (const LoopClosure& closure : verdict.closures) {
      const std::size_t from = place.at(closure.from), to = place.at(closure.to);
      const Timestamp both = std::max(file.vertices[from].stamp, file.vertices[to].stamp);
      const bool is_inter = closure.from.chain != closure.to.chain;
      const double delay_s = !is_inter ? 0.0 : rng.bernoulli(0.2) ? rng.uniform(20.0, 120.0) : 1.2;
      file.edges.push_back({both + delay_s, from, to, closure.measurement});
    }
  return file;
}

}  // namespace tutti::mission::fleets
