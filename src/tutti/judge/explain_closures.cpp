// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/explain_closures.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/judge/closure_support.hpp"
#include "tutti/judge/hypothesis.hpp"

namespace tutti::judge {
namespace {

class Search {
 public:
  /// All must outlive this.
  Search(const HypothesisSolver& solver, const OutlierRejectionConfig& config)
      : solver_(solver),
        config_(config),
        most_(std::max(config.least_hypotheses, config.tried_nodes / std::max<std::size_t>(solver.runs(), 1))) {}

  Solution run() const {
    Solution best = solver_.solve({});
    // Whatever failed pays for its places and at least one run.
    if (!best.solved || !config_.let_odometry_fail || best.unexplained < config_.least_votes + 1.0) return best;
    Solution proposal = without_impossible(proposed());
    if (!proposal.solved || proposal.failed.empty()) return best;
    proposal = without_idle(std::move(proposal));
    return proposal.solved && proposal.misfit < best.misfit ? proposal : best;
  }

 private:
  /// What is disregarded when all odometry may be, in windows around it.
  [[nodiscard]] Solution proposed() const {
    if (solver_.runs() == 0) return {};
    Solution all = solver_.solve({{0, solver_.runs() - 1}});
    std::vector<Window> windows;
    for (std::size_t run = 0; all.solved && run < solver_.runs(); ++run) {
      if (!all.disregarded[run]) continue;
      const Window window = solver_.around(run);
      if (!windows.empty() && window.first <= windows.back().last)
        windows.back().last = std::max(windows.back().last, window.last);
      else
        windows.push_back(window);
    }
    return solver_.judge(std::move(windows), std::move(all.optimum));
  }

  /// Takes back the windows in which odometry would have missed more than the robot can have moved. They go first: what
  /// else failed shows in a solution that is possible.
  [[nodiscard]] Solution without_impossible(Solution best) const {
    while (best.solved) {
      std::vector<std::size_t> impossible;
      for (std::size_t k = 0; k < best.hypothesis.size(); ++k)
        if (std::isinf(best.prices[k])) impossible.push_back(k);
      if (impossible.empty()) break;
      best = solver_.solve(without(best.hypothesis, impossible));
    }
    return best;
  }

  /// Takes back the windows that do not pay for themselves, the cheapest first and as many at once as together fit no
  /// worse than by what the cheapest of them pays: each alone would then fit no worse either. None goes without which
  /// another one would have to be a failure by more than the robot can have moved.
  [[nodiscard]] Solution without_idle(Solution best) const {
    std::set<std::size_t> needed;  // windows, by their first run
    for (std::size_t batch = best.hypothesis.size(); best.solved && solver_.work().hypotheses < most_;) {
      std::vector<std::size_t> open;
      for (std::size_t k = 0; k < best.hypothesis.size(); ++k)
        if (!needed.contains(best.hypothesis[k].first)) open.push_back(k);
      if (open.empty()) break;
      std::ranges::stable_sort(open, {}, [&](std::size_t k) { return best.prices[k]; });
      open.resize(std::min(batch, open.size()));
      Solution other = solver_.solve(without(best.hypothesis, open));
      const bool is_possible = std::isfinite(other.misfit) || std::isinf(best.misfit);
      if (other.solved && is_possible && other.fit - best.fit <= best.prices[open.front()]) {
        best = std::move(other);
        batch = 2 * open.size();
        continue;
      }
      if (open.size() == 1) needed.insert(best.hypothesis[open.front()].first);
      batch = std::max<std::size_t>(open.size() / 2, 1);
    }
    return best;
  }

  static Hypothesis without(const Hypothesis& hypothesis, std::span<const std::size_t> windows) {
    Hypothesis out;
    for (std::size_t k = 0; k < hypothesis.size(); ++k)
      if (std::ranges::find(windows, k) == windows.end()) out.push_back(hypothesis[k]);
    return out;
  }

  const HypothesisSolver& solver_;
  const OutlierRejectionConfig& config_;
  std::size_t most_;  // hypotheses
};

}  // namespace

Judgement explain_closures(PoseGraph graph, const OdometryTrajectories& odometry, std::size_t odometry_edges,
                           const OutlierRejectionConfig& config, const estimation::GncConfig& gnc,
                           const std::vector<bool>& certain) {
  TUTTI_CHECK(odometry_edges <= graph.edges.size(), "{} of {} edges", odometry_edges, graph.edges.size());
  const std::span<const PoseGraphEdge> closures = std::span(graph.edges).subspan(odometry_edges);
  TUTTI_CHECK(certain.empty() || certain.size() == closures.size(), "{} of {} closures", certain.size(),
              closures.size());
  const auto is_certain = [&](std::size_t c) { return !certain.empty() && certain[c]; };
  std::vector<bool> supported = supported_closures(odometry, closures, config);
  std::vector<bool> considered_certain;
  for (std::size_t c = 0; c < closures.size(); ++c) {
    if (is_certain(c)) supported[c] = true;
    if (supported[c]) considered_certain.push_back(is_certain(c));
  }
  std::vector<std::size_t> closure_of;  // of each one considered
  for (std::size_t c = 0; c < closures.size(); ++c) {
    if (!supported[c]) continue;
    graph.edges[odometry_edges + closure_of.size()] = graph.edges[odometry_edges + c];
    closure_of.push_back(c);
  }
  graph.edges.resize(odometry_edges + closure_of.size());
  const HypothesisSolver solver(graph, odometry, odometry_edges, config, gnc, std::move(considered_certain));
  const Solution best = Search(solver, config).run();

  Judgement out{.accepted = std::vector<bool>(supported.size(), false),
                .failed = {},
                .solved = best.solved,
                .work = solver.work()};
  if (!best.solved) return out;
  for (std::size_t k = 0; k < closure_of.size(); ++k) out.accepted[closure_of[k]] = best.accepted[k] != 0;
  for (const FailedSegment& failed : best.failed) out.failed.push_back(narrowed(odometry, failed));
  return out;
}

}  // namespace tutti::judge
