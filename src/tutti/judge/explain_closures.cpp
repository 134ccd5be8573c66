// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/explain_closures.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/judge/closure_support.hpp"
#include "tutti/judge/hypothesis.hpp"
#include "tutti/judge/patience.hpp"

namespace tutti::judge {
namespace {

/// A group of closures is at least so many.
constexpr std::size_t kLeastGroup = 2;

class Search {
 public:
  /// All must outlive this.
  Search(const HypothesisSolver& solver, const OutlierRejectionConfig& config)
      : solver_(solver),
        config_(config),
        most_(std::max(config.least_hypotheses, config.tried_nodes / std::max<std::size_t>(solver.runs(), 1))) {}

  Solution run(std::vector<std::vector<std::size_t>> groups) const {
    Solution best = solver_.solve({});
    // Whatever failed pays for its places and at least one run.
    if (!best.solved || !config_.let_odometry_fail || best.unexplained < config_.least_votes + 1.0) return best;
    if (is_out_of_patience()) return best;
    if (Solution proposal = without_impossible(proposed()); proposal.solved && !proposal.failed.empty())
      keep_better(best, without_idle(std::move(proposal)));
    ask_standstills(best);
    return refuse_groups(std::move(groups), best) ? without_idle(std::move(best)) : best;
  }

 private:
  static bool keep_better(Solution& best, Solution other) {
    if (!other.solved || other.misfit >= best.misfit) return false;
    best = std::move(other);
    return true;
  }

  /// Disregards windows around the odometry that is disregarded when all of it may be.
  [[nodiscard]] Solution proposed() const {
    if (solver_.runs() == 0) return {};
    Solution all = solver_.solve({{{0, solver_.runs() - 1}}, {}});
    std::vector<Window> windows;
    for (std::size_t run = 0; all.solved && run < solver_.runs(); ++run) {
      if (!all.disregarded[run]) continue;
      const Window window = solver_.around(run);
      if (!windows.empty() && window.first <= windows.back().last)
        windows.back().last = std::max(windows.back().last, window.last);
      else
        windows.push_back(window);
    }
    return solver_.judge({std::move(windows), {}}, std::move(all.optimum));
  }

  /// Odometry may have failed where it stood still, and only there: among all odometry, many small failures nearby
  /// explain the same, and do not pay for themselves.
  void ask_standstills(Solution& best) const {
    constexpr std::size_t kMost = 5;
    const std::vector<Window> standstills = solver_.standstills();
    for (std::size_t k = 0; k < std::min(kMost, standstills.size()); ++k) {
      if (is_out_of_patience() || best.unexplained < config_.least_votes + 1.0) return;
      Hypothesis other = best.hypothesis;
      std::erase_if(other.windows, [&](const Window& window) {
        return window.first <= standstills[k].last && standstills[k].first <= window.last;
      });
      other.windows.push_back(standstills[k]);
      std::ranges::sort(other.windows, {}, &Window::first);
      keep_better(best, solver_.solve(std::move(other)));
    }
  }

  /// Takes back the windows in which odometry would have missed more than the robot can have moved. They go first: what
  /// else failed shows in a solution that is possible.
  [[nodiscard]] Solution without_impossible(Solution best) const {
    while (best.solved) {
      std::vector<std::size_t> impossible;
      for (std::size_t k = 0; k < best.hypothesis.windows.size(); ++k)
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
    for (std::size_t batch = best.hypothesis.windows.size(); best.solved && solver_.work().hypotheses < most_;) {
      if (is_out_of_patience()) break;
      std::vector<std::size_t> open;
      for (std::size_t k = 0; k < best.hypothesis.windows.size(); ++k)
        if (!needed.contains(best.hypothesis.windows[k].first)) open.push_back(k);
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
      if (open.size() == 1) needed.insert(best.hypothesis.windows[open.front()].first);
      batch = std::max<std::size_t>(open.size() / 2, 1);
    }
    return best;
  }

  static Hypothesis without(const Hypothesis& hypothesis, std::span<const std::size_t> windows) {
    Hypothesis out{.windows = {}, .wrong = hypothesis.wrong};
    for (std::size_t k = 0; k < hypothesis.windows.size(); ++k)
      if (std::ranges::find(windows, k) == windows.end()) out.windows.push_back(hypothesis.windows[k]);
    return out;
  }

  /// As long as the misfit falls enough when all closures of a group are wrong. True if any are refused.
  bool refuse_groups(std::vector<std::vector<std::size_t>> groups, Solution& best) const {
    std::erase_if(groups, [](const auto& group) { return group.size() < kLeastGroup; });
    std::ranges::stable_sort(groups, std::greater(), [](const auto& group) { return group.size(); });
    for (int refused = 0; refused < config_.most_refused_groups; ++refused) {
      bool changed = false;
      int tried = 0;
      for (const auto& group : groups) {
        double price = 0.0;  // votes of what would be lost
        for (const std::size_t c : group) price += best.accepted[c] ? solver_.votes(c) : 0.0;
        if (changed || is_out_of_patience() || tried >= config_.candidate_groups || price >= best.unexplained) continue;
        ++tried;
        Hypothesis more = best.hypothesis;
        more.wrong.push_back(group);
        changed = keep_better(best, solver_.solve(std::move(more)));
      }
      if (!changed) return refused > 0;
    }
    return config_.most_refused_groups > 0;
  }

  const HypothesisSolver& solver_;
  const OutlierRejectionConfig& config_;
  std::size_t most_;  // hypotheses
};

}  // namespace

Judgement explain_closures(PoseGraph graph, const OdometryTrajectories& odometry, std::size_t odometry_edges,
                           std::span<const std::vector<std::size_t>> groups, const OutlierRejectionConfig& config,
                           const estimation::GncConfig& gnc, const std::vector<bool>& certain) {
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
  std::vector<std::size_t> position(closures.size(), 0);
  for (std::size_t c = 0; c < closures.size(); ++c) {
    if (!supported[c]) continue;
    position[c] = closure_of.size();
    graph.edges[odometry_edges + closure_of.size()] = graph.edges[odometry_edges + c];
    closure_of.push_back(c);
  }
  graph.edges.resize(odometry_edges + closure_of.size());
  std::vector<std::vector<std::size_t>> considered_groups;
  for (const auto& group : groups) {
    auto& own = considered_groups.emplace_back();
    for (const std::size_t c : group)
      if (supported[c] && !is_certain(c)) own.push_back(position[c]);
  }
  const HypothesisSolver solver(graph, odometry, odometry_edges, config, gnc, std::move(considered_certain));
  const Solution best = Search(solver, config).run(std::move(considered_groups));

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
