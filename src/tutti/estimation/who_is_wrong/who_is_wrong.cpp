// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/who_is_wrong/who_is_wrong.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/who_is_wrong/closure_support.hpp"
#include "tutti/estimation/who_is_wrong/hypothesis.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::estimation {
namespace {

/// Where in a stretch the jump is at most this many times the least, and this many metres more, odometry may have
/// failed.
constexpr double kAboutLeast = 1.5;
constexpr double kAboutLeast_m = 1.0;
/// A group of closures is at least so many.
constexpr std::size_t kLeastGroup = 2;

/// Far from where odometry turned wrongly, the jump would have to be larger: it failed about here.
FailedStretch narrowed(const OdometryWays& odometry, FailedStretch failed) {
  std::vector<double> sizes;
  for (std::size_t k = failed.from; k <= failed.to; ++k) sizes.push_back(failure_size_at(odometry, failed, k));
  const auto least = std::ranges::min_element(sizes);
  const auto is_larger = [about = kAboutLeast * *least + kAboutLeast_m](double size) { return size > about; };
  const auto begin = std::find_if(std::make_reverse_iterator(least), sizes.rend(), is_larger).base();
  const auto end = std::find_if(least, sizes.end(), is_larger);
  const std::size_t from = failed.from;
  failed.to = std::max(from + static_cast<std::size_t>(end - sizes.begin()) - 1, from + 1);
  failed.from = std::min(from + static_cast<std::size_t>(begin - sizes.begin()), failed.to - 1);
  return failed;
}

class Search {
 public:
  /// All must outlive this.
  Search(const HypothesisSolver& solver, const WhoIsWrongConfig& config) : solver_(solver), config_(config) {}

  Solution run(std::vector<std::vector<std::size_t>> groups) const {
    Solution best = solver_.solve({});
    // Whatever failed pays for its places and at least one run.
    if (!best.solved || !config_.let_odometry_fail || !best.suspicious || best.unexplained < config_.least_votes + 1.0)
      return best;
    if (Solution proposal = proposed(); proposal.solved && !proposal.failed.empty())
      keep_better(best, without_idle(std::move(proposal)));
    return refuse_groups(std::move(groups), best) ? without_idle(std::move(best)) : best;
  }

 private:
  static bool keep_better(Solution& best, Solution other) {
    if (!other.solved || other.misfit >= best.misfit) return false;
    best = std::move(other);
    return true;
  }

  /// What is let go when all odometry may be, in windows around it.
  [[nodiscard]] Solution proposed() const {
    if (solver_.runs() == 0) return {};
    Solution all = solver_.solve({{{0, solver_.runs() - 1}}, {}});
    std::vector<Window> windows;
    for (std::size_t run = 0; all.solved && run < solver_.runs(); ++run) {
      if (!all.let_go[run]) continue;
      const Window window = solver_.around(run);
      if (!windows.empty() && window.first <= windows.back().last)
        windows.back().last = std::max(windows.back().last, window.last);
      else
        windows.push_back(window);
    }
    return solver_.judge({std::move(windows), {}}, std::move(all.optimum));
  }

  /// Takes back the windows that do not pay for themselves, the one that costs most first.
  [[nodiscard]] Solution without_idle(Solution best) const {
    std::vector<char> needed(best.hypothesis.windows.size(), 0);
    while (best.solved) {
      std::optional<Solution> better;
      std::size_t idle = 0;
      for (std::size_t k = 0; k < best.hypothesis.windows.size(); ++k) {
        if (needed[k]) continue;
        Hypothesis less = best.hypothesis;
        less.windows.erase(less.windows.begin() + static_cast<std::ptrdiff_t>(k));
        Solution other = solver_.solve(std::move(less));
        // Fewer windows fit no better, and save at most what they pay.
        needed[k] = other.solved && other.misfit - other.price > best.misfit ? 1 : 0;
        if (!other.solved || other.misfit > (better ? better->misfit : best.misfit)) continue;
        better = std::move(other);
        idle = k;
      }
      if (!better) break;
      best = std::move(*better);
      needed.erase(needed.begin() + static_cast<std::ptrdiff_t>(idle));
    }
    return best;
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
        if (changed || tried >= config_.candidate_groups || price >= best.unexplained) continue;
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
  const WhoIsWrongConfig& config_;
};

}  // namespace

double failure_size_at(const OdometryWays& odometry, const FailedStretch& failed, std::size_t node) {
  const Pose3 T_to_node = odometry.T(failed.to, node);
  const Pose3 seen = T_to_node.inverse() * (retract(Pose3{}, failed.missed) * T_to_node);
  return failure_size(seen.translation.norm(), rotation_angle(seen));
}

Explanation explain_closures(const PoseGraph& graph, const OdometryWays& odometry, std::size_t odometry_edges,
                             std::span<const std::vector<std::size_t>> groups, const WhoIsWrongConfig& config,
                             const GncConfig& gnc, const std::vector<bool>& certain) {
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
  PoseGraph considered{
      .poses = graph.poses,
      .edges = {graph.edges.begin(), graph.edges.begin() + static_cast<std::ptrdiff_t>(odometry_edges)}};
  std::vector<std::size_t> closure_of;  // of each one considered
  std::vector<std::size_t> position(closures.size(), 0);
  for (std::size_t c = 0; c < closures.size(); ++c) {
    if (!supported[c]) continue;
    position[c] = closure_of.size();
    closure_of.push_back(c);
    considered.edges.push_back(closures[c]);
  }
  std::vector<std::vector<std::size_t>> considered_groups;
  for (const auto& group : groups) {
    auto& own = considered_groups.emplace_back();
    for (const std::size_t c : group)
      if (supported[c] && !is_certain(c)) own.push_back(position[c]);
  }
  const HypothesisSolver solver(considered, odometry, odometry_edges, config, gnc, std::move(considered_certain));
  const Solution best = Search(solver, config).run(std::move(considered_groups));

  Explanation out{.accepted = std::vector<bool>(closures.size(), false),
                  .failed = {},
                  .solved = best.solved,
                  .work = solver.work()};
  if (!best.solved) return out;
  for (std::size_t k = 0; k < closure_of.size(); ++k) out.accepted[closure_of[k]] = best.accepted[k] != 0;
  for (const FailedStretch& failed : best.failed) out.failed.push_back(narrowed(odometry, failed));
  return out;
}

}  // namespace tutti::estimation
