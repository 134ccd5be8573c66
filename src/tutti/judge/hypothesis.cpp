// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/hypothesis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>
#include <utility>

#include "tutti/base/chi_square.hpp"
#include "tutti/estimation/between_factor.hpp"
#include "tutti/estimation/edge_roles.hpp"
#include "tutti/estimation/truncated_least_squares.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::judge {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// A closure that is wrong for certain counts so little (as a factor on its information) that it moves nothing.
constexpr double kNothing = 1e-9;
/// Closures do not tell exactly where in a segment odometry failed. Each place is possible where the failure would be
/// at most this many times as large as at the place where it would be smallest, plus the usual motion of so many
/// seconds. A radian counts as much as so many seconds of motion.
constexpr double kAboutLeast = 1.5;
constexpr double kAboutLeast_s = 1.0;
constexpr double kRadian_s = 5.0;
/// Odometry fails by no more than a body moves in the time that it took, and in so many seconds more, as what jumps
/// between two samples has moved in no time at all.
constexpr double kReach_s = 2.0;
/// Odometry stands still where it goes slower than this share of the usual speed and turns slower than so many radians
/// a second; for at least so many seconds it is worth a question.
constexpr double kStillShare = 0.01, kStill_radps = 0.1 * kRadPerDeg, kLeastStill_s = 2.0;
/// Where solutions begin is solved to this share of the cost: with wrong closures in it the rest takes most of the
/// steps, and says nothing.
constexpr double kBeginning = 1e-3;

/// A segment's error, seen from one of its nodes: a wrong turn shifts everything the more the farther away it was.
Pose3 seen_from(const OdometryTrajectories& odometry, const FailedSegment& failed, std::size_t node) {
  const Pose3 T_to_node = odometry.T(failed.to, node);
  return T_to_node.inverse() * (retract(Pose3{}, failed.missed) * T_to_node);
}

/// How large a failure was, seen from there, in seconds of usual motion.
double size_at(const OdometryTrajectories& odometry, const FailedSegment& failed, std::size_t node) {
  const Pose3 seen = seen_from(odometry, failed, node);
  return seen.translation.norm() / odometry.usual_speed() + kRadian_s * rotation_angle(seen);
}

/// With nothing disregarded or refused.
estimation::PoseGraphSolution beginning(const PoseGraph& graph, estimation::GncConfig gnc) {
  gnc.solver.relative_cost_tolerance = std::max(kBeginning, gnc.solver.relative_cost_tolerance);
  return estimation::least_squares(graph, gnc);
}

}  // namespace

FailedSegment narrowed(const OdometryTrajectories& odometry, FailedSegment failed) {
  std::vector<double> sizes;
  for (std::size_t k = failed.from; k <= failed.to; ++k) sizes.push_back(size_at(odometry, failed, k));
  const auto least = std::ranges::min_element(sizes);
  const auto is_larger = [about = kAboutLeast * *least + kAboutLeast_s](double size) { return size > about; };
  const auto begin = std::find_if(std::make_reverse_iterator(least), sizes.rend(), is_larger).base();
  const auto end = std::find_if(least, sizes.end(), is_larger);
  const std::size_t from = failed.from;
  failed.to = std::max(from + static_cast<std::size_t>(end - sizes.begin()) - 1, from + 1);
  failed.from = std::min(from + static_cast<std::size_t>(begin - sizes.begin()), failed.to - 1);
  return failed;
}

bool is_possible(const OdometryTrajectories& odometry, const FailedSegment& failed) {
  const FailedSegment about = narrowed(odometry, failed);
  double least_m = kInfinite;
  for (std::size_t node = about.from; node <= about.to; ++node)
    least_m = std::min(least_m, seen_from(odometry, failed, node).translation.norm());
  return least_m <= odometry.reach_m(about.from, about.to) + kReach_s * odometry.usual_speed();
}

HypothesisSolver::HypothesisSolver(const PoseGraph& graph, const OdometryTrajectories& odometry,
                                   std::size_t odometry_edges, const OutlierRejectionConfig& config,
                                   const estimation::GncConfig& gnc, std::vector<bool> certain)
    : odometry_(odometry),
      config_(config),
      gnc_(gnc),
      limit_(chi_square_quantile(gnc.confidence, 6)),
      certain_(std::move(certain)) {
  const std::vector<estimation::EdgeRole> roles = estimation::roles_of(graph, odometry_edges);
  reduced_ = estimation::reduce_chains(graph, roles);
  for (std::size_t e = odometry_edges; e < graph.edges.size(); ++e) closures_.push_back(*reduced_.edge[e]);
  for (std::size_t e = 0; e < reduced_.graph.edges.size(); ++e)
    if (reduced_.roles[e] == estimation::EdgeRole::trusted) runs_.push_back(e);
  std::ranges::sort(runs_, {}, [&](std::size_t e) { return reduced_.graph.edges[e].from; });
  count_votes();
  all_kept_ = beginning(reduced_.graph, gnc_);
  work_.factorisations += static_cast<std::size_t>(all_kept_.summary.factorisations);
}

std::size_t HypothesisSolver::begin_of(std::size_t run) const {
  return reduced_.nodes[reduced_.graph.edges[runs_[run]].from];
}
std::size_t HypothesisSolver::end_of(std::size_t run) const {
  return reduced_.nodes[reduced_.graph.edges[runs_[run]].to];
}

/// Closures that look alike come by the square of the scans they join, so each shares the vote of the busier of its two
/// ends with all others that end there, at the same keyframe, between the same two segments.
void HypothesisSolver::count_votes() {
  using End = std::tuple<std::size_t, std::size_t, bool>;  // node, the other segment, which end
  std::map<End, int> closures_at;
  const auto ends_of = [&](std::size_t edge) {
    const auto [i, j] =
        std::minmax(reduced_.nodes[reduced_.graph.edges[edge].from], reduced_.nodes[reduced_.graph.edges[edge].to]);
    return std::pair(End{i, odometry_.segment(j), false}, End{j, odometry_.segment(i), true});
  };
  for (const std::size_t edge : closures_) {
    const auto [i, j] = ends_of(edge);
    ++closures_at[i];
    ++closures_at[j];
  }
  for (const std::size_t edge : closures_) {
    const auto [i, j] = ends_of(edge);
    votes_.push_back(1.0 / std::max(closures_at[i], closures_at[j]));
  }
}

Window HypothesisSolver::around(std::size_t run) const {
  Window out{run, run};
  const auto is_near = [&](std::size_t other) {
    return odometry_.segment(begin_of(other)) == odometry_.segment(begin_of(run)) &&
           std::max(odometry_.seconds(begin_of(run)) - odometry_.seconds(end_of(other)),
                    odometry_.seconds(begin_of(other)) - odometry_.seconds(end_of(run))) < config_.search_s;
  };
  while (out.first > 0 && is_near(out.first - 1)) --out.first;
  while (out.last + 1 < runs_.size() && is_near(out.last + 1)) ++out.last;
  return out;
}

std::vector<Window> HypothesisSolver::standstills() const {
  struct Still {
    Window window;
    double duration_s = 0.0;
  };
  std::vector<Still> all;
  std::size_t until = 0;  // node at which the newest one ends
  for (std::size_t run = 0; run < runs_.size(); ++run)
    for (std::size_t node = begin_of(run); node < end_of(run); ++node) {
      const double duration_s = odometry_.seconds(node + 1) - odometry_.seconds(node);
      const Pose3 motion = odometry_.T(node, node + 1);
      const bool is_still = motion.translation.norm() <= kStillShare * odometry_.usual_speed() * duration_s &&
                            rotation_angle(motion) <= kStill_radps * duration_s;
      if (!is_still) continue;
      if (all.empty() || until != node || run > all.back().window.last + 1) all.push_back({.window = {run, run}});
      all.back().window.last = run;
      all.back().duration_s += duration_s;
      until = node + 1;
    }
  std::erase_if(all, [](const Still& still) { return still.duration_s < kLeastStill_s; });
  std::ranges::stable_sort(all, std::ranges::greater(), &Still::duration_s);
  std::vector<Window> out;
  for (const Still& still : all) out.push_back(still.window);
  return out;
}

Solution HypothesisSolver::solve(Hypothesis hypothesis) const {
  std::vector<double> truncation(reduced_.graph.edges.size(), limit_);
  for (const std::size_t run : runs_) truncation[run] = kInfinite;
  for (std::size_t c = 0; c < closures_.size(); ++c)
    if (certain_[c]) truncation[closures_[c]] = kInfinite;
  for (const Window& window : hypothesis.windows)
    for (std::size_t run = window.first; run <= window.last; ++run) truncation[runs_[run]] = limit_;
  ++work_.hypotheses;
  const auto counted = [&](estimation::GncResult optimum, int before) {
    work_.factorisations += static_cast<std::size_t>(optimum.solution.summary.factorisations - before);
    return optimum;
  };
  if (hypothesis.wrong.empty())
    return judge(std::move(hypothesis),
                 counted(estimation::truncated_least_squares(reduced_.graph, gnc_, truncation, all_kept_),
                         all_kept_.summary.factorisations));
  PoseGraph graph = reduced_.graph;
  for (const auto& group : hypothesis.wrong)
    for (const std::size_t c : group) graph.edges[closures_[c]].information *= kNothing;
  return judge(std::move(hypothesis),
               counted(estimation::truncated_least_squares(graph, gnc_, truncation, beginning(graph, gnc_)), 0));
}

Solution HypothesisSolver::judge(Hypothesis hypothesis, estimation::GncResult optimum) const {
  Solution out{.hypothesis = std::move(hypothesis),
               .disregarded = {},
               .accepted = {},
               .failed = {},
               .optimum = std::move(optimum)};
  const estimation::GncResult& robust = out.optimum;
  const std::vector<Pose3>& poses = robust.solution.poses;
  out.solved = estimation::is_usable(robust.solution.summary.termination);
  if (!out.solved) return out;

  const auto error = [&](std::size_t e) {  // of a truncation
    const PoseGraphEdge& edge = reduced_.graph.edges[e];
    const Vector6d residual = estimation::between_residual(poses[edge.from], poses[edge.to], edge.T_from_to);
    return residual.dot(edge.information * residual) / limit_;
  };
  std::vector<double> excess{0.0};  // of the strain up to each run
  for (const std::size_t run : runs_) {
    out.disregarded.push_back(robust.inlier_weight[run] < 0.5);
    out.misfit += out.disregarded.back() ? 1.0 : error(run);
    excess.push_back(excess.back() + std::max(0.0, error(run) - 1.0));
  }
  for (std::size_t c = 0; c < closures_.size(); ++c) out.accepted.push_back(robust.inlier_weight[closures_[c]] >= 0.5);
  for (const auto& group : out.hypothesis.wrong)
    for (const std::size_t c : group) out.accepted[c] = 0;
  out.misfit += config_.least_votes * static_cast<double>(out.hypothesis.wrong.size());
  for (std::size_t c = 0; c < closures_.size(); ++c) {
    const double most = certain_[c] ? kInfinite : 1.0;
    out.misfit += votes_[c] * (out.accepted[c] ? std::min(error(closures_[c]), most) : 1.0);
    if (!out.accepted[c]) out.unexplained += votes_[c];
  }
  double strain = 0.0;
  for (std::size_t run = 0; run < runs_.size(); ++run) {
    const Window window = around(run);
    strain = std::max(strain, excess[window.last + 1] - excess[window.first]);
  }
  out.unexplained += strain;
  out.fit = out.misfit;
  find_failed(poses, out);
  return out;
}

/// The price that a segment pays for how far it failed, in truncations: the logarithm of the density of its error over
/// that of odometry's own errors. Along each of its six axes the density falls with the power 1.25 of the error's size,
/// up to what a body can do, so that large failures are rarer than small ones. With the power 1, errors of any size are
/// as likely, to a factor, and two failures that cancel each other explain a group of look-alikes too cheaply.
double HypothesisSolver::votes_for(const FailedSegment& failed) const {
  if (!is_possible(odometry_, failed)) return kInfinite;
  const Matrix6d covariance = odometry_.between(failed.from, failed.to).covariance;
  const double missed2 = squared_distance(failed.missed, covariance);
  constexpr double kPower = 1.25, kAxes = 6.0;
  return std::max(0.0, kPower * kAxes / limit_ * std::log(missed2 / limit_));
}

void HypothesisSolver::find_failed(const std::vector<Pose3>& poses, Solution& out) const {
  std::vector<Window> paying;
  for (const Window& window : out.hypothesis.windows) {
    const std::size_t known = out.failed.size();
    for (std::size_t run = window.first; run <= window.last; ++run) {
      if (!out.disregarded[run]) continue;
      const bool continues = out.failed.size() > known && out.failed.back().to == begin_of(run);
      if (!continues) out.failed.push_back({.from = begin_of(run)});
      FailedSegment& failed = out.failed.back();
      failed.to = end_of(run);
      const auto at = [&](std::size_t node) {
        return poses[std::ranges::lower_bound(reduced_.nodes, node) - reduced_.nodes.begin()];
      };
      failed.missed = local(odometry_.T(failed.from, failed.to), at(failed.from).inverse() * at(failed.to));
    }
    if (out.failed.size() == known) continue;
    paying.push_back(window);
    double& price = out.prices.emplace_back(config_.least_votes);
    for (std::size_t f = known; f < out.failed.size(); ++f) price += votes_for(out.failed[f]);
    out.misfit += price;
  }
  out.hypothesis.windows = std::move(paying);
}

}  // namespace tutti::judge
