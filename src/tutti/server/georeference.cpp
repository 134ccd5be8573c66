// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/georeference.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "tutti/geometry/so3.hpp"
#include "tutti/server/fix_factors.hpp"

namespace tutti::server {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

/// A map is wrong by no more than the whole distance travelled, plus this.
constexpr double kBeyondDistance_m = 100.0;

/// A part of the map without a gap, and how it lies on the earth.
struct Part {
  std::vector<std::size_t> submaps;  ///< Indices in PlacedFixes.
  FixAlignment alignment;
  double distance_m = 0.0;
  [[nodiscard]] bool is_aligned() const { return alignment.why_not.empty(); }
};
using Parts = std::map<std::uint32_t, Part>;  // by component

FixAlignment align(const Part& part, const PlacedFixes& placed, const MapEstimate& map) {
  std::vector<FixedPoint> points;
  for (const std::size_t s : part.submaps) add_points(placed.submaps[s], s, map.graph.poses, points);
  return align_fixes(points);
}

/// Receivers that state far too little of their errors state more in `placed` then; by how much.
Parts align_parts(PlacedFixes& placed, const MapEstimate& map, std::map<ChainId, double>& understated) {
  Parts parts;
  for (std::size_t s = 0; s < placed.submaps.size(); ++s) parts[placed.submaps[s].component].submaps.push_back(s);
  for (std::size_t e = 0; e < map.odometry_edges; ++e)
    if (const auto part = parts.find(map.nodes[map.graph.edges[e].from].component); part != parts.end())
      part->second.distance_m += map.graph.edges[e].T_from_to.translation.norm();
  std::map<std::uint32_t, Pose3> T_enu_world;
  for (auto& [component, part] : parts) {
    part.alignment = align(part, placed, map);
    T_enu_world[component] = part.alignment.T_enu_world;
  }
  understated = raise_to_neighbours(map, placed, T_enu_world);
  return parts;
}

/// Those that are aligned become one, in the world frame of the first.
void join_parts(const Parts& parts, MapEstimate& map) {
  const auto first = std::ranges::find_if(parts, [](const auto& part) { return part.second.is_aligned(); });
  const Pose3 T_world_enu = first->second.alignment.T_enu_world.inverse();
  const auto is_moved = [&](std::uint32_t component) {
    const auto part = parts.find(component);
    return part != parts.end() && part->second.is_aligned() && part != first;
  };
  std::vector<std::uint32_t> label(map.components);
  std::uint32_t next = 0;
  for (std::uint32_t c = 0; c < map.components; ++c) label[c] = is_moved(c) ? label[first->first] : next++;
  map.components = next;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    MapNode& node = map.nodes[i];
    if (is_moved(node.component))
      map.graph.poses[i] = node.T_world_body =
          T_world_enu * parts.at(node.component).alignment.T_enu_world * node.T_world_body;
    node.component = label[node.component];
  }
}

/// A part that is laid on the earth as it is gets one edge, from enu to the node nearest to the middle.
PoseGraphEdge tie(const Part& part, const PlacedFixes& placed, const MapEstimate& map, const Pose3& T_enu_world) {
  const Vector3d& middle = part.alignment.middle_enu;
  const auto from_middle = [&](std::size_t s) {
    return (T_enu_world * map.graph.poses[placed.submaps[s].fixes.front().node].translation - middle).norm();
  };
  const std::size_t node = placed.submaps[*std::ranges::min_element(part.submaps, {}, from_middle)].fixes.front().node;
  const Pose3 T_enu_body = T_enu_world * map.graph.poses[node];
  const Matrix3d R = T_enu_body.rotation.toRotationMatrix().transpose();
  Matrix6d to_body = Matrix6d::Zero();
  to_body << R, -R * skew(T_enu_body.translation - middle), Matrix3d::Zero(), R;
  return {.from = map.nodes.size(),
          .to = node,
          .T_from_to = T_enu_body,
          .information = judge::information_of(to_body * part.alignment.covariance * to_body.transpose())};
}

/// For submaps in no part that counts.
FixFactors nothing_yet(const PlacedFixes& placed, const Pose3& T_enu_world) {
  return {.objections = std::vector<FixObjection>(placed.submaps.size(), FixObjection::unaligned),
          .joined = std::vector<OneFix>(placed.submaps.size()),
          .understated = {},
          .T_enu_world = T_enu_world,
          .edges = {}};
}

/// Joins and judges each submap's fixes by the alignment of their part, before the map is bent.
void assess(const Part& part, const PlacedFixes& placed, const MapEstimate& map, FixFactors& factors) {
  for (const std::size_t s : part.submaps) {
    factors.joined[s] = join(placed.submaps[s], map.graph.poses, factors.T_enu_world);
    factors.objections[s] = FixObjection::none;
    if (factors.joined[s].used == 0)
      factors.objections[s] = FixObjection::contradictory;
    else if (missed_by(factors.joined[s], map.graph.poses, factors.T_enu_world).norm() >
             part.distance_m + kBeyondDistance_m)
      factors.objections[s] = FixObjection::misfit;
  }
}

std::optional<LevelNode> level_node(const Part& part, const PlacedFixes& placed, const MapEstimate& map,
                                    const Pose3& T_enu_world) {
  if (!part.alignment.is_levelled) return std::nullopt;
  const std::size_t node = placed.submaps[part.submaps.front()].fixes.front().node;
  return LevelNode{node, (T_enu_world * map.graph.poses[node]).rotation};
}

/// Odometry that has drifted far does not fit as it is, but may once it is bent. Parts of which that makes alignments
/// that are certain are bent.
void bend_what_does_not_fit(const PlacedFixes& placed, const estimation::GncConfig& gnc, Parts& parts,
                            MapEstimate& map) {
  for (auto& [component, part] : parts) {
    if (part.is_aligned() || part.submaps.size() < 3) continue;
    MapEstimate bent = map;
    FixFactors factors = nothing_yet(placed, part.alignment.T_enu_world);
    assess(part, placed, map, factors);
    std::vector<LevelNode> level;
    if (const auto node = level_node(part, placed, map, factors.T_enu_world)) level.push_back(*node);
    if (!bend_to_fixes(placed, level, gnc, bent, factors)) continue;
    const auto agree = std::ranges::count(factors.objections, FixObjection::none);
    FixAlignment alignment = align(part, placed, bent);
    if (!alignment.why_not.empty() || 2 * static_cast<std::size_t>(agree) < part.submaps.size()) continue;
    part.alignment = std::move(alignment);
    for (std::size_t i = 0; i < map.nodes.size(); ++i)
      if (map.nodes[i].component == component) map.graph.poses[i] = map.nodes[i].T_world_body = bent.graph.poses[i];
  }
}

/// In parts that stay as they are, a submap's fixes count where half of them fit the alignment.
void judge_as_it_is(const PlacedFixes& placed, const Parts& parts, const MapEstimate& map, FixFactors& factors) {
  for (const auto& [component, part] : parts) {
    if (!part.is_aligned()) continue;
    std::size_t point = 0;
    for (const std::size_t s : part.submaps) {
      std::size_t fits = 0;
      for (std::size_t k = 0; k < placed.submaps[s].fixes.size(); ++k) fits += part.alignment.fits[point++] ? 1 : 0;
      if (factors.objections[s] == FixObjection::none && 2 * fits <= placed.submaps[s].fixes.size())
        factors.objections[s] = FixObjection::misfit;
    }
    factors.edges.push_back(tie(part, placed, map, factors.T_enu_world));
  }
}

void report_fixes(const PlacedFixes& placed, const Parts& parts, const FixFactors& factors, MapEstimate& map) {
  for (std::size_t s = 0; s < placed.submaps.size(); ++s) {
    const FixObjection objection = factors.objections[s];
    const bool has_place = factors.joined[s].used > 0;
    map.fixes.judged.push_back(
        {placed.submaps[s].submap, placed.submaps[s].fixes.size(),
         objection == FixObjection::none ? factors.joined[s].used : 0, objection,
         has_place ? missed_by(factors.joined[s], map.graph.poses, factors.T_enu_world).norm() : 0.0});
  }
  for (const auto& [component, part] : parts)
    if (!part.is_aligned())
      map.fixes.unaligned.push_back({placed.submaps[part.submaps.front()].submap.chain, part.alignment.why_not});
  map.fixes.understated = factors.understated;
  map.fixes.edges = factors.edges;
}

}  // namespace

const char* to_string(FixObjection objection) {
  switch (objection) {
    case FixObjection::none:
      return "";
    case FixObjection::contradictory:
      return "they contradict each other";
    case FixObjection::misfit:
      return "they do not fit the map";
    case FixObjection::unaligned:
      return "where their component of the map lies on the earth is not certain";
  }
  return "";
}

MapEstimate georeferenced(MapEstimate map, const SubmapSet& submaps, const GeoreferenceConfig& config,
                          const estimation::GncConfig& gnc) {
  if (config.mode == "off" || !map.converged) return map;
  auto placed = place_fixes(map, submaps, config.correlation_s);
  if (!placed) return map;
  std::map<ChainId, double> understated;
  Parts parts = align_parts(*placed, map, understated);
  if (config.mode == "factors") bend_what_does_not_fit(*placed, gnc, parts, map);
  const auto first = std::ranges::find_if(parts, [](const auto& part) { return part.second.is_aligned(); });
  if (first == parts.end()) {
    report_fixes(*placed, parts, nothing_yet(*placed, {}), map);
    return map;
  }
  join_parts(parts, map);
  FixFactors factors = nothing_yet(*placed, first->second.alignment.T_enu_world);
  factors.understated = understated;
  std::vector<LevelNode> level;
  for (const auto& [component, part] : parts) {
    if (!part.is_aligned()) continue;
    assess(part, *placed, map, factors);
    if (const auto node = level_node(part, *placed, map, factors.T_enu_world)) level.push_back(*node);
  }
  if (config.mode == "only" || !bend_to_fixes(*placed, level, gnc, map, factors))
    judge_as_it_is(*placed, parts, map, factors);
  report_fixes(*placed, parts, factors, map);
  Georeference out{.origin = placed->origin,
                   .T_enu_world = factors.T_enu_world,
                   .component = map.nodes[placed->submaps[first->second.submaps.front()].fixes.front().node].component};
  for (const auto& [component, part] : parts) {
    if (!part.is_aligned()) continue;
    out.is_levelled = out.is_levelled || part.alignment.is_levelled;
    out.sigma_m = std::max(out.sigma_m, part.alignment.sigma_m());
    out.sigma_yaw_rad = std::max(out.sigma_yaw_rad, part.alignment.sigma_yaw_rad());
  }
  map.fixes.georeference = out;
  return map;
}

PoseGraph graph_on_earth(const MapEstimate& map) {
  PoseGraph out = map.graph;
  if (map.fixes.edges.empty()) return out;
  out.poses.push_back(map.fixes.georeference->T_enu_world.inverse());
  out.edges.insert(out.edges.end(), map.fixes.edges.begin(), map.fixes.edges.end());
  return out;
}

}  // namespace tutti::server
