// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/fix_factors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "tutti/base/chi_square.hpp"
#include "tutti/estimation/pose_graph_solver.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::server {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

constexpr int kRaises = 4;
/// A lever arm is turned by the map, whose heading its fix is to correct: so far that may be off, round after round.
constexpr std::array kHeadings_rad{0.2, 0.05, 0.0};
/// Iterations of least squares, at the end.
constexpr int kTurns = 2;

class Bender {
 public:
  Bender(const PlacedFixes& placed, const std::vector<LevelNode>& level, const estimation::GncConfig& gnc,
         MapEstimate& map, FixFactors& factors)
      : placed_(placed), level_(level), gnc_(gnc), map_(map), factors_(factors) {
    gnc_.solver.initialisation = "given";
    for (std::size_t s = 0; s < factors.objections.size(); ++s)
      if (factors.objections[s] == FixObjection::none) candidates_.push_back(s);
  }

  bool bend() {
    for (const double heading_rad : kHeadings_rad) {
      heading_rad_ = heading_rad;
      if ((heading_rad == 0.0 || matters(heading_rad)) && !judge()) return false;
    }
    for (int raise = 0; raise < kRaises && raise_understated(); ++raise)
      if (!judge()) return false;
    std::erase_if(candidates_, [&](std::size_t s) { return factors_.objections[s] != FixObjection::none; });
    for (int turn = 0; turn < kTurns; ++turn)
      if (!solve()) return false;
    factors_.edges = all_edges(true);
    return true;
  }

 private:
  /// Whether such an error of the heading moves a lever arm's end by more than the sigma of its fix.
  [[nodiscard]] bool matters(double heading_rad) const {
    return std::ranges::any_of(candidates_, [&](std::size_t s) {
      const OneFix& fix = factors_.joined[s];
      return heading_rad * fix.p_node_antenna.norm() > std::sqrt(fix.covariance.trace() / 3.0);
    });
  }

  /// The antenna's place becomes the body's by the rotation that the map has now: edges without information about
  /// rotation.
  [[nodiscard]] std::vector<PoseGraphEdge> edges(bool share_errors) const {
    std::vector<PoseGraphEdge> out;
    for (const std::size_t s : candidates_) {
      const OneFix& fix = factors_.joined[s];
      const Eigen::Quaterniond R = (factors_.T_enu_world * map_.graph.poses[fix.node]).rotation;
      const Matrix3d covariance = fix.covariance * (share_errors ? placed_.submaps[s].correlation : 1.0) +
                                  std::pow(heading_rad_ * fix.p_node_antenna.norm(), 2) * Matrix3d::Identity();
      const Matrix3d W = covariance.inverse();
      PoseGraphEdge& edge = out.emplace_back(PoseGraphEdge{.from = map_.nodes.size(),
                                                           .to = fix.node,
                                                           .T_from_to = {R, fix.p_enu - R * fix.p_node_antenna},
                                                           .information = Matrix6d::Zero()});
      const Matrix3d R_enu_body = R.toRotationMatrix();
      edge.information.topLeftCorner<3, 3>() = R_enu_body.transpose() * W * R_enu_body;
    }
    return out;
  }

  [[nodiscard]] std::vector<PoseGraphEdge> level_edges() const {
    std::vector<PoseGraphEdge> out;
    for (const LevelNode& level : level_) {
      PoseGraphEdge& edge = out.emplace_back(PoseGraphEdge{.from = map_.nodes.size(),
                                                           .to = level.node,
                                                           .T_from_to = {level.R_enu_body, Vector3d::Zero()},
                                                           .information = Matrix6d::Zero()});
      const double w = 1.0 / (kSigmaLevel_rad * kSigmaLevel_rad);
      const Matrix3d R = level.R_enu_body.toRotationMatrix();
      edge.information.bottomRightCorner<3, 3>() = R.transpose() * Vector3d(w, w, 0.0).asDiagonal() * R;
    }
    return out;
  }

  /// The fixes' edges are the last.
  [[nodiscard]] PoseGraph graph(bool share_errors) const {
    PoseGraph out = map_.graph;
    out.poses.push_back(factors_.T_enu_world.inverse());
    for (const PoseGraphEdge& edge : all_edges(share_errors)) out.edges.push_back(edge);
    return out;
  }
  [[nodiscard]] std::vector<PoseGraphEdge> all_edges(bool share_errors) const {
    std::vector<PoseGraphEdge> out = level_edges();
    for (const PoseGraphEdge& edge : edges(share_errors)) out.push_back(edge);
    return out;
  }

  bool adopt(const estimation::PoseGraphSolution& solution) {
    if (!estimation::is_usable(solution.summary.termination)) return false;
    map_.graph.poses.assign(solution.poses.begin(), solution.poses.end() - 1);
    factors_.T_enu_world = solution.poses.back().inverse();
    return true;
  }

  bool judge() {
    const PoseGraph all = graph(false);
    const std::size_t first = all.edges.size() - candidates_.size();
    std::vector<estimation::EdgeRole> roles(all.edges.size(), estimation::EdgeRole::trusted);
    std::fill(roles.begin() + static_cast<std::ptrdiff_t>(first), roles.end(), estimation::EdgeRole::robust);
    const auto found = estimation::solve_pose_graph_gnc(all, gnc_, roles);
    for (std::size_t k = 0; k < candidates_.size(); ++k)
      factors_.objections[candidates_[k]] =
          found.inlier_weight[first + k] >= 0.5 ? FixObjection::none : FixObjection::misfit;
    return adopt(found.solution);
  }

  bool solve() { return adopt(estimation::solve_pose_graph(graph(true), gnc_.solver)); }

  bool raise_understated() {
    std::map<ChainId, std::vector<double>> misfits;
    for (const std::size_t s : candidates_) {
      const Vector3d missed = missed_by(factors_.joined[s], map_.graph.poses, factors_.T_enu_world);
      misfits[placed_.submaps[s].submap.chain].push_back(squared_distance(missed, factors_.joined[s].covariance));
    }
    bool any = false;
    for (auto& [chain, of_chain] : misfits) {
      const double factor = understated_by(of_chain);
      if (factor <= 1.0) continue;
      factors_.understated.try_emplace(chain, 1.0).first->second *= factor;
      for (const std::size_t s : candidates_)
        if (placed_.submaps[s].submap.chain == chain) factors_.joined[s].covariance *= factor;
      any = true;
    }
    return any;
  }

  const PlacedFixes& placed_;
  const std::vector<LevelNode>& level_;
  estimation::GncConfig gnc_;
  MapEstimate& map_;
  FixFactors& factors_;
  std::vector<std::size_t> candidates_;
  double heading_rad_ = 0.0;
};

}  // namespace

Vector3d missed_by(const OneFix& fix, std::span<const Pose3> T_world_body, const Pose3& T_enu_world) {
  return T_enu_world * (T_world_body[fix.node] * fix.p_node_antenna) - fix.p_enu;
}

bool bend_to_fixes(const PlacedFixes& placed, const std::vector<LevelNode>& level, const estimation::GncConfig& gnc,
                   MapEstimate& map, FixFactors& factors) {
  const std::vector<Pose3> poses = map.graph.poses;
  const FixFactors before = factors;
  if (Bender(placed, level, gnc, map, factors).bend()) {
    for (std::size_t i = 0; i < map.nodes.size(); ++i) map.nodes[i].T_world_body = map.graph.poses[i];
    return true;
  }
  map.graph.poses = poses;
  factors = before;
  return false;
}

}  // namespace tutti::server
