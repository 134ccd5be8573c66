// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "tutti/geometry/covariance.hpp"
#include "tutti/wire/codec.hpp"
#include "tutti/wire/field_bytes.hpp"
#include "tutti/wire/internal/visual_codec.hpp"
#include "tutti/wire/limits.hpp"

namespace tutti::wire {
namespace {

Status at_most(std::size_t count, std::size_t limit, const char* what) {
  if (count <= limit) return {};
  return fail(ErrorCode::invalid, "{} {}, at most {} are accepted", count, what, limit);
}

Status check_submap(const Submap& submap) {
  if (submap.keyframes.empty()) return fail(ErrorCode::invalid, "no keyframes, expected at least one");
  if (auto ok = at_most(submap.keyframes.size(), kMaxKeyframes, "keyframes"); !ok) return ok;
  if (submap.odometry.size() + 1 != submap.keyframes.size())
    return fail(ErrorCode::invalid, "{} odometry factors for {} keyframes, expected one fewer", submap.odometry.size(),
                submap.keyframes.size());
  for (std::size_t k = 0; k < submap.keyframes.size(); ++k) {
    const Keyframe& keyframe = submap.keyframes[k];
    const auto where = [&] { return "keyframe " + std::to_string(keyframe.index); };
    if (auto ok = FieldChecker::check_value(keyframe.T_odom_body); !ok) return in_context(where(), ok.error());
    if (k == 0) continue;
    const Keyframe& previous = submap.keyframes[k - 1];
    if (previous.index == 0xffffffffU || keyframe.index != previous.index + 1)
      return fail(ErrorCode::invalid, "keyframe {} follows keyframe {}, expected consecutive indices", keyframe.index,
                  previous.index);
    if (keyframe.stamp <= previous.stamp)
      return fail(ErrorCode::invalid, "{}: stamp {} ns is not after {} ns", where(), keyframe.stamp.ns,
                  previous.stamp.ns);
    const RelativePose& odometry = submap.odometry[k - 1];
    if (auto ok = FieldChecker::check_value(odometry.T_a_b); !ok)
      return in_context("odometry to " + where(), ok.error());
    if (auto ok = FieldChecker::check_value(odometry.covariance); !ok)
      return in_context("odometry to " + where(), ok.error());
  }
  if (auto ok = at_most(submap.fixes.size(), kMaxFixes, "fixes"); !ok) return ok;
  for (std::size_t i = 0; i < submap.fixes.size(); ++i) {
    const SubmapFix& fix = submap.fixes[i];
    if (fix.keyframe < submap.keyframes.front().index || fix.keyframe > submap.keyframes.back().index)
      return fail(ErrorCode::invalid, "fix {} is at keyframe {}, expected one of {} to {}", i, fix.keyframe,
                  submap.keyframes.front().index, submap.keyframes.back().index);
    if (auto ok = check_fix(fix.antenna, fix.covariance, fix.p_keyframe_antenna); !ok)
      return in_context("fix " + std::to_string(i), ok.error());
  }
  if (auto ok = at_most(submap.ranges.size(), kMaxRanges, "ranges"); !ok) return ok;
  for (std::size_t i = 0; i < submap.ranges.size(); ++i)
    if (auto ok = check_range(submap.ranges[i]); !ok) return in_context("range " + std::to_string(i), ok.error());
  if (submap.visual != nullptr)
    if (auto ok = check_visual(submap); !ok) return in_context("visual", ok.error());
  return submap.cloud == nullptr ? Status() : validate(*submap.cloud);
}

/// Strictly ascending by (chain, stamp).
template <class Node>
Status check_order(const std::vector<Node>& nodes, const char* what) {
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const Node& a = nodes[i - 1];
    const Node& b = nodes[i];
    if (b.chain < a.chain || (b.chain == a.chain && b.stamp <= a.stamp))
      return fail(ErrorCode::invalid, "{} {} (robot {}, {} ns) does not come after (robot {}, {} ns)", what, i,
                  to_string(b.chain), b.stamp.ns, to_string(a.chain), a.stamp.ns);
  }
  return {};
}

Status check_edges(const ProxyGraph& graph) {
  if (!graph.reduced && (!graph.edges.empty() || !graph.eliminated.empty()))
    return fail(ErrorCode::invalid, "{} edges and {} eliminated nodes in an unreduced graph, expected none",
                graph.edges.size(), graph.eliminated.size());
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    const ProxyEdge& edge = graph.edges[i];
    if (edge.a >= graph.nodes.size() || edge.b >= graph.nodes.size() || edge.a == edge.b)
      return fail(ErrorCode::invalid, "edge {} joins nodes {} and {} of {}", i, edge.a, edge.b, graph.nodes.size());
    if (graph.nodes[edge.a].chain != graph.nodes[edge.b].chain)
      return fail(ErrorCode::invalid, "edge {} joins robots {} and {}, expected one chain", i,
                  to_string(graph.nodes[edge.a].chain), to_string(graph.nodes[edge.b].chain));
    if (!std::isfinite(static_cast<float>(edge.weight)) || edge.weight <= 0.0)
      return fail(ErrorCode::invalid, "edge {} has weight {}, expected a finite one > 0", i, edge.weight);
  }
  return {};
}

Status check_nodes(const ProxyGraph& graph) {
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const auto where = [&] { return "node " + std::to_string(i); };
    if (auto ok = FieldChecker::check_value(graph.nodes[i].T_world_body); !ok) return in_context(where(), ok.error());
    if (auto ok = FieldChecker::check_value(graph.nodes[i].covariance); !ok) return in_context(where(), ok.error());
  }
  return check_order(graph.nodes, "node");
}

Status check_sigma(const PoseSigma& sigma) {
  const auto is_sigma = [](double value) { return std::isfinite(value) && value >= 0.0; };
  if (is_sigma(sigma.position_m) && is_sigma(sigma.rotation_rad)) return {};
  return fail(ErrorCode::invalid, "a sigma of {} m, {} rad, expected finite ones >= 0", sigma.position_m,
              sigma.rotation_rad);
}

Status check_scale(const ScaleUncertainty& scale, std::size_t nodes) {
  if (scale.sigma.empty()) return {};
  if (scale.sigma.size() != ChainUncertainty::blocks(nodes))
    return fail(ErrorCode::invalid, "{} sigmas, expected {} of {} nodes", scale.sigma.size(),
                ChainUncertainty::blocks(nodes), nodes);
  for (const PoseSigma& sigma : scale.sigma) {
    if (auto ok = check_sigma(sigma); !ok) return ok;
    if (!(sigma.position_m > 0.0 && sigma.rotation_rad > 0.0))
      return fail(ErrorCode::invalid, "a sigma of {} m, {} rad, expected > 0", sigma.position_m, sigma.rotation_rad);
  }
  return {};
}

Status check_direction(const KnownDirection& direction, std::size_t nodes) {
  const std::size_t spread = ChainUncertainty::spread(nodes).size();
  const std::size_t expected = spread == 0 ? 0 : 3 * (spread - 1);
  if (direction.position.size() != expected || direction.rotation.size() != expected)
    return fail(ErrorCode::invalid, "a direction of {} and {} numbers, expected {} of {} nodes",
                direction.position.size(), direction.rotation.size(), expected, nodes);
  for (const double value : {direction.sigma, direction.rotation_scale})
    if (!std::isfinite(value) || value <= 0.0)
      return fail(ErrorCode::invalid, "a direction with sigma {} and ratio {}, expected finite ones > 0",
                  direction.sigma, direction.rotation_scale);
  return {};
}

Status check_uncertainty(const ChainUncertainty& uncertainty, std::size_t nodes) {
  if (nodes == 0) return fail(ErrorCode::invalid, "the robot has no nodes");
  for (const auto& ok :
       {check_sigma(uncertainty.whole), at_most(uncertainty.scales.size(), ChainUncertainty::kMostScales, "scales"),
        at_most(uncertainty.directions.size(), ChainUncertainty::kMostDirections, "directions")})
    if (!ok) return ok;
  for (const ScaleUncertainty& scale : uncertainty.scales)
    if (auto ok = check_scale(scale, nodes); !ok) return ok;
  for (const KnownDirection& direction : uncertainty.directions)
    if (auto ok = check_direction(direction, nodes); !ok) return ok;
  return uncertainty.doubted ? check_direction(*uncertainty.doubted, nodes) : Status{};
}

Status check_uncertainties(const ProxyGraph& graph) {
  for (std::size_t i = 0; i < graph.uncertainties.size(); ++i) {
    const ChainId& chain = graph.uncertainties[i].chain;
    if (i > 0 && chain <= graph.uncertainties[i - 1].chain)
      return fail(ErrorCode::invalid, "the uncertainty of robot {} does not come after robot {}'s", to_string(chain),
                  to_string(graph.uncertainties[i - 1].chain));
    if (auto ok = check_uncertainty(graph.uncertainties[i], nodes_of(graph, chain).size()); !ok)
      return in_context("uncertainty of robot " + to_string(chain), ok.error());
  }
  return {};
}

Status check_last_seen(const ProxyGraph& graph) {
  for (std::size_t i = 0; i < graph.last_seen.size(); ++i) {
    const LastSeen& seen = graph.last_seen[i];
    const std::string where = "robot " + to_string(seen.chain) + " as last seen";
    if (i > 0 && seen.chain.robot <= graph.last_seen[i - 1].chain.robot)
      return fail(ErrorCode::invalid, "{} does not come after robot {}", where,
                  to_string(graph.last_seen[i - 1].chain));
    if (!component_of(graph, seen.chain)) return fail(ErrorCode::invalid, "{} has no component", where);
    if (auto ok = FieldChecker::check_value(seen.T_world_body); !ok) return in_context(where, ok.error());
    if (seen.name.empty()) continue;
    if (auto ok = FieldChecker::check(seen.name, {.text = FieldRule::Text::name}); !ok)
      return in_context(where, ok.error());
  }
  return {};
}

Status check_graph(const ProxyGraph& graph) {
  for (const auto& ok : {at_most(graph.nodes.size(), kMaxProxyNodes, "nodes"),
                         at_most(graph.eliminated.size(), kMaxProxyNodes, "eliminated nodes"),
                         at_most(graph.edges.size(), kMaxProxyEdges, "edges"),
                         at_most(graph.components.size(), ProxyGraph::kMostChains, "components")})
    if (!ok) return ok;
  for (const double value : {graph.radius_m, graph.sigma_m})
    if (!std::isfinite(value) || value <= 0.0)
      return fail(ErrorCode::invalid, "radius {} m, sigma {} m, expected > 0", graph.radius_m, graph.sigma_m);
  for (std::size_t i = 1; i < graph.components.size(); ++i)
    if (graph.components[i].chain <= graph.components[i - 1].chain)
      return fail(ErrorCode::invalid, "the component of robot {} does not come after robot {}'s",
                  to_string(graph.components[i].chain), to_string(graph.components[i - 1].chain));
  if (auto ok = check_nodes(graph); !ok) return ok;
  if (auto ok = check_order(graph.eliminated, "eliminated node"); !ok) return ok;
  for (const auto& check : {check_uncertainties, check_last_seen})
    if (auto ok = check(graph); !ok) return ok;
  return check_edges(graph);
}

}  // namespace

Status validate(const SubmapMessage& message) {
  const SubmapId id = message.submap.id;
  const std::string where = "submap " + to_string(id);
  const ChainId sender{message.header.robot, message.header.session};
  if (sender != id.chain)
    return fail(ErrorCode::invalid, "{}: sent by robot {}, expected its own robot and session", where,
                to_string(sender));
  if (auto ok = check_submap(message.submap); !ok) return in_context(where, ok.error());
  return {};
}

Status validate(const PointCloud& cloud) {
  if (auto ok = at_most(cloud.points.size(), kMaxCloudPoints, "points"); !ok) return ok;
  for (const Eigen::Vector3f& point : cloud.points)
    if (!point.allFinite() || point.cwiseAbs().maxCoeff() > static_cast<float>(kMaxCloudRange_m))
      return fail(ErrorCode::invalid, "point ({}, {}, {}) is not within {} m", point.x(), point.y(), point.z(),
                  kMaxCloudRange_m);
  return {};
}

Status validate(const ProxyGraphMessage& message) {
  if (auto ok = check_graph(message.graph); !ok)
    return in_context(fmt::format("proxy graph {}", message.graph.revision), ok.error());
  return {};
}

}  // namespace tutti::wire
