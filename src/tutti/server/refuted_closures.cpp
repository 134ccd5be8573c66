// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/refuted_closures.hpp"

#include <algorithm>
#include <utility>

#include "tutti/server/submap_fixes.hpp"

namespace tutti::server {
namespace {

/// Standard deviations.
constexpr double kRefuted = 5.0;
/// One wrong join gone, another may be believed.
constexpr int kRounds = 3;

/// How well the fixes alone determine where on the earth a place on a session is: what half of its fixes miss by is
/// what drift and their own errors make.
double sigma_m(const FixAlignment& session, const Eigen::Vector3d& p_enu) {
  return session.sigma_m() + session.sigma_yaw_rad() * (p_enu - session.middle_enu).norm() + session.median_miss_m;
}

std::map<ChainId, FixAlignment> sessions_on_earth(const MapEstimate& map, const PlacedFixes& placed) {
  std::map<ChainId, std::vector<FixedPoint>> points;
  for (std::size_t s = 0; s < placed.submaps.size(); ++s)
    add_points(placed.submaps[s], s, map.graph.poses, points[placed.submaps[s].submap.chain]);
  std::map<ChainId, FixAlignment> out;
  for (const auto& [chain, of_chain] : points)
    if (FixAlignment alignment = align_fixes(of_chain); alignment.why_not.empty())
      out.emplace(chain, std::move(alignment));
  return out;
}

}  // namespace

std::set<SubmapPair> refuted_by_fixes(const MapEstimate& map, const SubmapSet& submaps, const VerdictSet& verdicts,
                                      const GeoreferenceConfig& config, const DecisionSet& decisions) {
  std::set<SubmapPair> out;
  if (config.mode == "off" || !map.converged) return out;
  std::set<std::pair<KeyframeId, KeyframeId>> accepted;
  for (const JudgedClosure& judged : map.closures)
    if (judged.accepted && !judged.by_operator && judged.closure.from.chain != judged.closure.to.chain)
      accepted.insert({judged.closure.from, judged.closure.to});
  if (accepted.empty()) return out;
  const auto placed = place_fixes(map, submaps, config.correlation_s);
  if (!placed) return out;
  const auto sessions = sessions_on_earth(map, *placed);
  const auto is_refuted = [&](const LoopClosure& closure) {
    const auto a = sessions.find(closure.from.chain), b = sessions.find(closure.to.chain);
    if (a == sessions.end() || b == sessions.end() || !accepted.contains({closure.from, closure.to})) return false;
    const Pose3 T_world_to = find_node(map, closure.from)->T_world_body * closure.measurement.T_a_b;
    const Eigen::Vector3d by_fixes = a->second.T_enu_world * T_world_to.translation;
    const Eigen::Vector3d found = b->second.T_enu_world * find_node(map, closure.to)->T_world_body.translation;
    return (by_fixes - found).norm() > kRefuted * std::hypot(sigma_m(a->second, by_fixes), sigma_m(b->second, found));
  };
  for (const auto& [pair, verdict] : verdicts)
    if (!says(decisions, pair, Wish::accept) && std::ranges::any_of(verdict.closures, is_refuted)) out.insert(pair);
  return out;
}

MapEstimate estimate_map_with_fixes(const SubmapSet& submaps, const VerdictSet& verdicts, const MapConfig& config,
                                    const DecisionSet& decisions) {
  MapEstimate map = estimate_map(submaps, verdicts, config, decisions);
  std::set<SubmapPair> refuted;
  for (int round = 0; round < kRounds; ++round) {
    const std::set<SubmapPair> more = refuted_by_fixes(map, submaps, verdicts, config.georeference, decisions);
    if (more.empty()) break;
    refuted.insert(more.begin(), more.end());
    const judge::SearchWork before = map.work;
    map = estimate_map(submaps, verdicts, config, decisions, refuted);
    map.work += before;
  }
  return map;
}

}  // namespace tutti::server
