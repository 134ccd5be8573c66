// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/judge_closures.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/judge/internal/optimiser.hpp"
#include "tutti/judge/patience.hpp"

namespace tutti::judge {
namespace {

/// How often what the search decided is decided otherwise, of each kind.
constexpr int kDecisions = 5;
/// Two robots of whose closures fewer are in the map have no map together, if so many of those that each has with
/// itself were asked: a robot's own closures are seldom wrong, and say that its odometry is.
constexpr double kLeastShare = 0.2;
constexpr std::size_t kEnoughOwn = 8;

std::vector<double> seconds_of(const std::vector<MapNode>& nodes) {
  std::vector<double> out;
  for (const MapNode& node : nodes) out.push_back(node.stamp - nodes.front().stamp);
  return out;
}

}  // namespace

Optimiser::Optimiser(const OdometryGraph& map, const NodeIndex& index, const Closures& closures,
                     const OutlierRejectionConfig& config, const estimation::GncConfig& gnc)
    : map_(map),
      closures_(closures.judged),
      certain_(closures.certain),
      config_(config),
      gnc_(gnc),
      odometry_(seconds_of(map.nodes), map.searched.edges) {
  for (const LoopClosure& closure : closures.judged)
    closure_edges_.push_back({.from = index.at(closure.from),
                              .to = index.at(closure.to),
                              .T_from_to = closure.measurement.T_a_b,
                              .information = information_of(closure.measurement.covariance)});
}

/// Groups that look alike support each other and may lead the search astray; where nothing supports anything, random
/// closures do. So the other search is made where the first one's map is not plausible.
Optimum Optimiser::decide() const {
  Optimum best = searched(config_.least_support);
  if (is_usable(best) && !is_out_of_patience() && !is_plausible(best)) {
    Optimum other = searched(0);
    SearchWork work = best.work;
    work += other.work;
    if (is_usable(other) && score(other) < score(best)) best = std::move(other);
    best.work = work;
  }
  if (!is_searched_as_it_counts()) best = settle(map_.graph, std::move(best));
  if (is_usable(best) && leave_outvoted(best.objections)) best = settle(map_.graph, std::move(best));
  return solved(std::move(best));
}

Optimum Optimiser::searched(int least_support) const {
  Optimum best = settle(map_.searched, explain(least_support));
  for (int round = 0; round < kDecisions && !is_out_of_patience() && lay_joint_anew(best);) ++round;
  bool blames_odometry = true;
  int refusals = 0;
  while (refusals < kDecisions && !is_out_of_patience() && refuse_lone_witness(best, blames_odometry)) ++refusals;
  if (is_out_of_patience()) return best;
  ask_again(best);
  for (int round = 0; refusals > 0 && round < kDecisions && !is_out_of_patience() && lay_joint_anew(best);) ++round;
  return best;
}

bool Optimiser::is_searched_as_it_counts() const {
  return std::ranges::equal(map_.searched.edges, map_.graph.edges, {}, &PoseGraphEdge::information,
                            &PoseGraphEdge::information);
}

PoseGraph Optimiser::with_room(const PoseGraph& odometry) const {
  PoseGraph out{.poses = odometry.poses, .edges = {}};
  out.edges.reserve(odometry.edges.size() + closure_edges_.size());
  out.edges.assign(odometry.edges.begin(), odometry.edges.end());
  return out;
}

bool Optimiser::is_open(Objection objection) {
  return objection == Objection::none || objection == Objection::contradicted || objection == Objection::dear ||
         objection == Objection::too_few;
}

estimation::SolverConfig Optimiser::from_there() const {
  estimation::SolverConfig out = gnc_.solver;
  out.initialisation = "given";
  return out;
}

Optimum Optimiser::explain(int least_support) const {
  PoseGraph graph = with_room(map_.searched);
  graph.edges.insert(graph.edges.end(), closure_edges_.begin(), closure_edges_.end());
  OutlierRejectionConfig config = config_;
  config.least_support = least_support;
  std::vector<std::size_t> all(closures_.size());
  std::iota(all.begin(), all.end(), std::size_t{0});
  const auto groups = closure_groups(map_.nodes, closure_edges_, all, GroupLimits::of_neighbours());
  Judgement found = explain_closures(std::move(graph), odometry_, map_.odometry_edges, groups, config, gnc_, certain_);
  std::vector<Objection> objections;
  for (const bool accepted : found.accepted) objections.push_back(accepted ? Objection::none : Objection::contradicted);
  leave_unjoined(objections);
  return {.failed = std::move(found.failed),
          .graph = {},
          .closure_of_edge = {},
          .solution = {},
          .objections = std::move(objections),
          .prices = std::vector<Price>(closures_.size()),
          .work = found.work};
}

Optimiser::Segments Optimiser::segments_of(std::size_t closure) const {
  const PoseGraphEdge& edge = closure_edges_[closure];
  return std::minmax({odometry_.segment(edge.from), odometry_.segment(edge.to)});
}

void Optimiser::leave_unjoined(std::vector<Objection>& objections) const {
  std::map<Segments, std::vector<std::size_t>> between;
  for (std::size_t c = 0; c < closures_.size(); ++c) between[segments_of(c)].push_back(c);
  const auto least = config_.min_joining_closures;
  for (const auto& [segments, all] : between) {
    if (segments.first == segments.second || std::ranges::any_of(all, [&](std::size_t c) { return certain_[c]; }))
      continue;
    const bool never_enough = std::ssize(all) < least;
    const auto is_left = [&](std::size_t c) { return objections[c] == Objection::none; };
    if (!never_enough && std::ranges::count_if(all, is_left) >= least) continue;
    for (const std::size_t c : all)
      if (never_enough || is_left(c)) objections[c] = Objection::too_few;
  }
}

bool Optimiser::leave_outvoted(std::vector<Objection>& objections) const {
  struct Votes {
    std::size_t in = 0, out = 0;
    [[nodiscard]] bool is_lost() const { return static_cast<double>(in) < kLeastShare * static_cast<double>(in + out); }
  };
  std::map<Segments, Votes> votes;  // of a segment with itself, too
  std::map<Segments, std::vector<std::size_t>> joining;
  for (std::size_t c = 0; c < closures_.size(); ++c) {
    const Segments ends = segments_of(c);
    const bool is_in = objections[c] == Objection::none;
    ++(is_in ? votes[ends].in : votes[ends].out);
    if (ends.first != ends.second && is_in) joining[ends].push_back(c);
  }
  bool changes = false;
  for (const auto& [ends, closures] : joining) {
    Votes own = votes[{ends.first, ends.first}];
    const Votes &other = votes[{ends.second, ends.second}], &between = votes[ends];
    own.in += other.in;
    own.out += other.out;
    const Votes all{own.in + between.in, own.out + between.out};
    const auto is_certain = [&](std::size_t c) { return certain_[c]; };
    if (own.out < kEnoughOwn || !own.is_lost() || !all.is_lost() || std::ranges::any_of(closures, is_certain)) continue;
    for (const std::size_t c : closures) objections[c] = Objection::outvoted;
    changes = true;
  }
  return changes;
}

void Optimiser::place_by_odometry(PoseGraph& graph) const {
  const auto [part, count] = components(graph);
  std::vector<std::optional<Pose3>> T_odometry_solved(static_cast<std::size_t>(count));
  for (std::size_t k = 0; k < graph.poses.size(); ++k) {
    auto& T = T_odometry_solved[static_cast<std::size_t>(part[k])];
    if (!T) T = map_.graph.poses[k] * graph.poses[k].inverse();
    graph.poses[k] = *T * graph.poses[k];
  }
}

Optimum Optimiser::settle(const PoseGraph& odometry, Optimum out) const {
  out.graph = with_room(odometry);
  out.closure_of_edge.clear();
  out.solution = {};
  for (const FailedSegment& segment : out.failed)
    weaken(out.graph, map_.odometry_edges, segment.from, segment.to, segment.missed.head<3>().norm(),
           segment.missed.tail<3>().norm());
  PoseGraph all = with_room(out.graph);
  std::vector<std::size_t> asked;
  std::vector<char> in;
  std::vector<bool> certain;
  for (std::size_t c = 0; c < closures_.size(); ++c) {
    if (!is_open(out.objections[c])) continue;
    asked.push_back(c);
    in.push_back(out.objections[c] == Objection::none ? 1 : 0);
    certain.push_back(certain_[c]);
    all.edges.push_back(closure_edges_[c]);
  }
  Settled settled = settle_closures(all, map_.odometry_edges, std::move(in), certain, config_, gnc_.solver);
  out.work.factorisations += settled.factorisations;
  out.graph.poses = std::move(settled.poses);
  for (std::size_t k = 0; k < asked.size(); ++k) {
    Objection& objection = out.objections[asked[k]];
    out.prices[asked[k]] = settled.prices[k];
    if (settled.in[k] == 0) {
      if (objection == Objection::none || std::isfinite(settled.prices[k].paid)) objection = Objection::dear;
      continue;
    }
    objection = Objection::none;
    out.graph.edges.push_back(closure_edges_[asked[k]]);
    out.closure_of_edge.push_back(asked[k]);
  }
  place_by_odometry(out.graph);
  out.solution.summary.termination = settled.termination;
  out.solution.poses = out.graph.poses;
  return out;
}

Optimum Optimiser::solved(Optimum out) const {
  if (!estimation::is_usable(out.solution.summary.termination)) return out;
  out.solution = estimation::solve_pose_graph(out.graph, from_there());
  PoseGraph anew{.poses = map_.graph.poses, .edges = std::move(out.graph.edges)};
  estimation::PoseGraphSolution other = estimation::solve_pose_graph(anew, gnc_.solver);
  out.graph.edges = std::move(anew.edges);
  for (const auto* solution : {&out.solution, &other})
    out.work.factorisations += static_cast<std::size_t>(solution->summary.factorisations);
  const bool is_known = estimation::is_usable(out.solution.summary.termination);
  if (estimation::is_usable(other.summary.termination) &&
      (!is_known || estimation::is_cheaper(other.summary.final_cost, out.solution.summary.final_cost))) {
    out.solution = std::move(other);
    out.from_measurements = true;
  }
  return out;
}

Matrix6d information_of(const Matrix6d& covariance) {
  Matrix6d floored = covariance;
  floored.diagonal().head<3>().array() += kLeastTranslation_m * kLeastTranslation_m;
  floored.diagonal().tail<3>().array() += kLeastRotation_rad * kLeastRotation_rad;
  const Matrix6d inverse = inverse_of(floored);
  return 0.5 * (inverse + inverse.transpose());
}

void weaken(PoseGraph& graph, std::size_t odometry_edges, std::size_t from, std::size_t to, double sigma_m,
            double sigma_rad) {
  for (std::size_t e = 0; e < odometry_edges; ++e) {
    PoseGraphEdge& edge = graph.edges[e];
    if (edge.from < from || edge.to > to) continue;
    Matrix6d covariance = inverse_of(edge.information);
    const double steps = static_cast<double>(to - from);
    covariance.diagonal().head<3>().array() += sigma_m * sigma_m / steps;
    covariance.diagonal().tail<3>().array() += sigma_rad * sigma_rad / steps;
    edge.information = information_of(covariance);
  }
}

Optimum judge_closures(const OdometryGraph& map, const NodeIndex& index, const Closures& closures,
                       const OutlierRejectionConfig& config, const estimation::GncConfig& gnc) {
  return Optimiser(map, index, closures, config, gnc).decide();
}

std::string reason_of(Objection objection, const Price& price) {
  if (objection == Objection::dear && std::isfinite(price.paid))
    return fmt::format("{}: {:.0f} (at most {:.0f})", to_string(objection), price.paid, price.most);
  if (objection == Objection::lone && std::isfinite(price.paid))
    return fmt::format("{}: by {:.0f} (at most {:.0f})", to_string(objection), price.paid, price.most);
  return to_string(objection);
}

const char* to_string(Objection objection) {
  switch (objection) {
    case Objection::none:
      return "";
    case Objection::operators:
      return "by an operator";
    case Objection::fixes:
      return "position fixes contradict it";
    case Objection::contradicted:
      return "odometry and other closures contradict it and nothing else joins its ends";
    case Objection::too_few:
      return "too few closures join these two";
    case Objection::dear:
      return "the map would pay more for it than a right one costs";
    case Objection::lone:
      return "with those of its place it contradicts the rest of the map";
    case Objection::outvoted:
      return "nearly all closures of these two contradict their odometry";
    case Objection::no_map:
      return "the map cannot be solved";
  }
  return "";
}

}  // namespace tutti::judge
