// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/judge/judge_closures.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "tutti/base/chi_square.hpp"
#include "tutti/estimation/influence.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/judge/closure_groups.hpp"

namespace tutti::judge {
namespace {

/// What failed odometry missed is measured; that it was this much more is as likely as not.
constexpr double kDoubt = 2.0;

/// Closures of neighbouring submaps may be wrong all together.
constexpr double kNeighbours_s = 15.0;

/// How many groups of closures can be refused as lone witnesses against all the rest.
constexpr int kRefusals = 5;

class Optimiser {
 public:
  /// All must outlive this.
  Optimiser(const OdometryGraph& map, const NodeIndex& index, const Closures& closures, const WhoIsWrongConfig& config,
            const estimation::GncConfig& gnc)
      : map_(map), closures_(closures.judged), certain_(closures.certain), config_(config), gnc_(gnc) {
    for (const LoopClosure& closure : closures.judged)
      closure_edges_.push_back({.from = index.at(closure.from),
                                .to = index.at(closure.to),
                                .T_from_to = closure.measurement.T_a_b,
                                .information = information_of(closure.measurement.covariance)});
  }

  [[nodiscard]] Optimum decide() const {
    auto [objections, failed, work] = explain();
    Optimum best = optimise(std::move(objections), std::move(failed), work);
    for (int round = 0; round < kRefusals && refuse_lone_witness(best);) ++round;
    return best;
  }

 private:
  /// Objections to each closure, and the odometry that failed. What it takes is gone when the map is optimised.
  [[nodiscard]] std::tuple<std::vector<Objection>, std::vector<FailedStretch>, SearchWork> explain() const {
    PoseGraph graph = map_.graph;
    graph.edges.insert(graph.edges.end(), closure_edges_.begin(), closure_edges_.end());
    std::vector<double> seconds;
    for (const MapNode& node : map_.nodes) seconds.push_back(node.stamp - map_.nodes.front().stamp);
    const OdometryWays odometry(seconds, map_.graph.edges);
    std::vector<std::size_t> all(closures_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    const auto groups = closure_groups(map_.nodes, closure_edges_, all,
                                       {kNeighbours_s, std::numeric_limits<double>::infinity(), closures_.size()});
    auto found = explain_closures(graph, odometry, map_.odometry_edges, groups, config_, gnc_, certain_);
    std::vector<Objection> objections;
    for (const bool accepted : found.accepted)
      objections.push_back(accepted ? Objection::none : Objection::contradicted);
    leave_unjoined(odometry, objections);
    return {std::move(objections), std::move(found.failed), found.work};
  }

  /// Too few closures do not join two pieces of odometry, unless an operator says so.
  void leave_unjoined(const OdometryWays& odometry, std::vector<Objection>& objections) const {
    std::map<std::pair<std::size_t, std::size_t>, std::vector<std::size_t>> between;
    for (std::size_t c = 0; c < closures_.size(); ++c)
      between[std::minmax({odometry.piece(closure_edges_[c].from), odometry.piece(closure_edges_[c].to)})].push_back(c);
    const auto least = config_.min_joining_closures;
    for (const auto& [pieces, all] : between) {
      if (pieces.first == pieces.second || std::ranges::any_of(all, [&](std::size_t c) { return certain_[c]; }))
        continue;
      const bool never_enough = std::ssize(all) < least;
      const auto is_left = [&](std::size_t c) { return objections[c] == Objection::none; };
      if (!never_enough && std::ranges::count_if(all, is_left) >= least) continue;
      for (const std::size_t c : all)
        if (never_enough || is_left(c)) objections[c] = Objection::too_few;
    }
  }

  [[nodiscard]] Optimum optimise(std::vector<Objection> objections, std::vector<FailedStretch> failed,
                                 const SearchWork& work) const {
    Optimum out{.failed = std::move(failed),
                .graph = map_.graph,
                .closure_of_edge = {},
                .robust = {},
                .fitting = {},
                .objections = std::move(objections),
                .work = work};
    for (const FailedStretch& stretch : out.failed)
      weaken(out.graph, map_.odometry_edges, stretch.from, stretch.to, kDoubt * stretch.missed.head<3>().norm(),
             kDoubt * stretch.missed.tail<3>().norm());
    for (std::size_t c = 0; c < closures_.size(); ++c) {
      // What did not fit before may fit without what has been refused since.
      if (out.objections[c] == Objection::misfit) out.objections[c] = Objection::none;
      if (out.objections[c] != Objection::none) continue;
      out.graph.edges.push_back(closure_edges_[c]);
      out.closure_of_edge.push_back(c);
    }
    std::vector<estimation::EdgeRole> roles(out.graph.edges.size(), estimation::EdgeRole::robust);
    std::fill_n(roles.begin(), map_.odometry_edges, estimation::EdgeRole::trusted);
    for (std::size_t e = map_.odometry_edges; e < roles.size(); ++e)
      if (is_certain(out, e)) roles[e] = estimation::EdgeRole::trusted;
    out.robust = estimation::solve_pose_graph_gnc(out.graph, gnc_, roles);
    out.work.factorisations += static_cast<std::size_t>(out.robust.solution.summary.factorisations);
    for (std::size_t e = map_.odometry_edges; e < out.graph.edges.size(); ++e) {
      if (out.robust.inlier_weight[e] >= 0.5)
        out.fitting.push_back(e);
      else
        out.objections[out.closure_of_edge[e - map_.odometry_edges]] = Objection::misfit;
    }
    return out;
  }

  /// Of an edge beyond odometry.
  [[nodiscard]] bool is_certain(const Optimum& of, std::size_t edge) const {
    return certain_[of.closure_of_edge[edge - map_.odometry_edges]];
  }

  /// Takes back the group of closures at one pair of places that contradicts all the rest of the map most, if it does
  /// beyond chance: as a lone closure against odometry, a lone group is wrong itself. False if there is none.
  [[nodiscard]] bool refuse_lone_witness(Optimum& best) const {
    if (!estimation::is_usable(best.robust.solution.summary.termination)) return false;
    PoseGraph fitted{.poses = {},
                     .edges = {best.graph.edges.begin(),
                               best.graph.edges.begin() + static_cast<std::ptrdiff_t>(map_.odometry_edges)}};
    fitted.poses = best.graph.poses;
    for (const std::size_t e : best.fitting) fitted.edges.push_back(best.graph.edges[e]);
    std::vector<std::size_t> closures;  // among the edges of `fitted`
    for (std::size_t k = 0; k < best.fitting.size(); ++k)
      if (!is_certain(best, best.fitting[k])) closures.push_back(map_.odometry_edges + k);
    std::vector<estimation::EdgeRole> roles(fitted.edges.size(), estimation::EdgeRole::robust);
    std::fill_n(roles.begin(), map_.odometry_edges, estimation::EdgeRole::trusted);
    const auto groups = closure_groups(map_.nodes, fitted.edges, closures);
    ++best.work.factorisations;
    const auto misfits = estimation::group_misfits(fitted, best.robust.solution.poses, roles, groups);
    const auto worst = std::ranges::max_element(misfits);
    if (worst == misfits.end() || *worst <= chi_square_quantile(config_.confidence, 6)) return false;
    for (const std::size_t e : groups[static_cast<std::size_t>(worst - misfits.begin())])
      best.objections[best.closure_of_edge[best.fitting[e - map_.odometry_edges] - map_.odometry_edges]] =
          Objection::lone;
    best = optimise(std::move(best.objections), std::move(best.failed), best.work);
    return true;
  }

  const OdometryGraph& map_;
  const std::vector<LoopClosure>& closures_;
  const std::vector<bool>& certain_;
  const WhoIsWrongConfig& config_;
  const estimation::GncConfig& gnc_;
  std::vector<PoseGraphEdge> closure_edges_;
};

}  // namespace

Matrix6d information_of(const Matrix6d& covariance) {
  Matrix6d floored = covariance;
  floored.diagonal().head<3>().array() += kLeastTranslation_m * kLeastTranslation_m;
  floored.diagonal().tail<3>().array() += kLeastRotation_rad * kLeastRotation_rad;
  const Matrix6d inverse = floored.llt().solve(Matrix6d::Identity());
  return 0.5 * (inverse + inverse.transpose());
}

void weaken(PoseGraph& graph, std::size_t odometry_edges, std::size_t from, std::size_t to, double sigma_m,
            double sigma_rad) {
  for (std::size_t e = 0; e < odometry_edges; ++e) {
    PoseGraphEdge& edge = graph.edges[e];
    if (edge.from < from || edge.to > to) continue;
    Matrix6d covariance = edge.information.inverse();
    const double steps = static_cast<double>(to - from);
    covariance.diagonal().head<3>().array() += sigma_m * sigma_m / steps;
    covariance.diagonal().tail<3>().array() += sigma_rad * sigma_rad / steps;
    edge.information = information_of(covariance);
  }
}

Optimum judge_closures(const OdometryGraph& map, const NodeIndex& index, const Closures& closures,
                       const WhoIsWrongConfig& config, const estimation::GncConfig& gnc) {
  return Optimiser(map, index, closures, config, gnc).decide();
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
      return "odometry and other closures contradict it";
    case Objection::too_few:
      return "too few closures join these two";
    case Objection::misfit:
      return "does not fit the map";
    case Objection::lone:
      return "with those of its place it contradicts the rest of the map";
    case Objection::no_map:
      return "the map cannot be solved";
  }
  return "";
}

}  // namespace tutti::judge
