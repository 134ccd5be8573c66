// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/perfect_judge.hpp"

#include <map>
#include <set>
#include <utility>

#include "tutti/mission/true_poses.hpp"

namespace tutti::mission {

std::optional<server::MapEstimate> judge_perfectly(const server::MapServer& server, const server::MapConfig& config,
                                                   const std::vector<const MissionRecording*>& robots,
                                                   const evaluation::AssociationConfig& association,
                                                   const ClosureCheckConfig& check) {
  const server::MapServerState& state = server.state();
  std::set<std::pair<KeyframeId, KeyframeId>> judged;
  for (const server::JudgedClosure& c : server.map().closures) judged.emplace(c.closure.from, c.closure.to);
  server::VerdictSet verdicts = state.verdicts;
  std::vector<LoopClosure> all;
  for (auto& [pair, verdict] : verdicts) {
    std::erase_if(verdict.closures, [&](const LoopClosure& c) { return !judged.contains({c.from, c.to}); });
    all.insert(all.end(), verdict.closures.begin(), verdict.closures.end());
  }
  const std::map<KeyframeId, Pose3> truth = true_ends(all, server.map(), robots, association);
  DecisionSet decisions = state.decisions;
  bool checked = false;
  for (auto& [pair, verdict] : verdicts) {
    bool known = !verdict.closures.empty();
    std::erase_if(verdict.closures, [&](const LoopClosure& closure) {
      const auto error = closure_error(closure, truth);
      known = known && error.has_value();
      return error && is_wrong(*error, check);
    });
    checked = checked || known;
    if (known && !verdict.closures.empty()) decisions[pair] = {.closure = {}, .wish = Wish::accept, .by = "reference"};
  }
  if (!checked) return std::nullopt;
  return server::estimate_map(state.submaps, verdicts, config, decisions);
}

}  // namespace tutti::mission
