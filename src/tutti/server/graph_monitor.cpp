// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/graph_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/base/chi_square.hpp"
#include "tutti/base/random.hpp"
#include "tutti/consistency/chain_uncertainty.hpp"
#include "tutti/estimation/influence.hpp"
#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/judge/closure_groups.hpp"
#include "tutti/server/georeference.hpp"
#include "tutti/server/map_components.hpp"
#include "tutti/server/map_posterior.hpp"

namespace tutti::server {
namespace {

/// Indices of the nodes of each chain that become proxy nodes, in time order.
std::map<ChainId, std::vector<std::size_t>> choose_nodes(const MapEstimate& map) {
  const MapComponents components = choose_components(map);
  std::map<ChainId, std::vector<std::size_t>> chosen;
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    const MapNode& node = map.nodes[i];
    if (node.representative && node.component == components.of_chain.at(node.id.chain))
      chosen[node.id.chain].push_back(i);
  }
  return chosen;
}

/// Ranks among a chain's chosen nodes between which its odometry failed: the closures tell where `last` is seen from
/// `first`, but little of what lies between.
struct Repair {
  std::size_t first = 0;
  std::size_t last = 0;
};

std::vector<Repair> repairs(const MapEstimate& map, const ChainId& chain, const std::vector<std::size_t>& chosen) {
  const auto index_of = [&](std::size_t node) { return map.nodes[node].id.index; };
  std::vector<Repair> out;
  for (const FailedOdometry& failed : map.failed_odometry) {
    if (failed.chain != chain) continue;
    const auto after = std::ranges::upper_bound(chosen, failed.from, {}, index_of);
    const auto last = std::ranges::lower_bound(chosen, failed.to, {}, index_of);
    if (after == chosen.begin() || last == chosen.end()) continue;
    const Repair repair{static_cast<std::size_t>(after - chosen.begin()) - 1,
                        static_cast<std::size_t>(last - chosen.begin())};
    if (!out.empty() && repair.first < out.back().last)
      out.back().last = std::max(out.back().last, repair.last);
    else
      out.push_back(repair);
  }
  return out;
}

/// The map hinges on a group of closures without which it would move by more than its own uncertainty lets one expect
/// of the worst of all its groups (six numbers each), but for this probability. A smaller move is part of that
/// uncertainty.
constexpr double kFalseHinge = 0.01;

/// By how much the nodes would move without the one or the other group of accepted closures on which the map hinges,
/// for those that move it most. Two places that look alike make all closures between them wrong, so a group counts as
/// one witness, and goes as one.
struct Hinges {
  Eigen::MatrixXd shifts;                        ///< (6 nodes) x groups, right tangents.
  std::vector<std::vector<std::size_t>> groups;  ///< Positions in map.graph.edges.
};

Hinges hinges_of(const MapEstimate& map, const PoseGraph& on_earth, const std::vector<std::size_t>& nodes,
                 std::size_t count) {
  std::vector<std::size_t> closures(map.graph.edges.size() - map.odometry_edges - map.ranges.edges);
  std::iota(closures.begin(), closures.end(), map.odometry_edges);
  const auto groups = judge::closure_groups(map.nodes, map.graph.edges, closures);
  std::vector<estimation::Influence> influences;
  if (!groups.empty()) {
    std::vector<estimation::EdgeRole> roles(on_earth.edges.size(), estimation::EdgeRole::trusted);
    for (const std::size_t e : closures) roles[e] = estimation::EdgeRole::robust;
    const double probability = 1.0 - kFalseHinge / static_cast<double>(groups.size());
    influences = estimation::largest_influences(on_earth, on_earth.poses, roles, groups, count,
                                                std::sqrt(chi_square_quantile(probability, 6.0)));
  }
  const auto rows = static_cast<Eigen::Index>(6 * nodes.size());
  Hinges out{.shifts = Eigen::MatrixXd(rows, static_cast<Eigen::Index>(influences.size())), .groups = {}};
  for (const estimation::Influence& influence : influences) {
    const auto c = static_cast<Eigen::Index>(out.groups.size());
    for (std::size_t k = 0; k < nodes.size(); ++k)
      out.shifts.col(c).segment<6>(static_cast<Eigen::Index>(6 * k)) =
          influence.shift.segment<6>(static_cast<Eigen::Index>(6 * nodes[k]));
    out.groups.push_back(groups[influence.group]);
  }
  return out;
}

/// How many places along a chain each group measures: no more than it has closures, nor than there are spread nodes
/// from its first closure to its last at either end.
std::vector<std::size_t> places_of(const MapEstimate& map, const std::vector<std::vector<std::size_t>>& groups,
                                   std::span<const std::size_t> spread) {
  const auto between = [&](std::size_t first, std::size_t last) {
    return std::ranges::upper_bound(spread, last) - std::ranges::lower_bound(spread, first);
  };
  std::vector<std::size_t> out;
  for (const auto& group : groups) {
    std::ptrdiff_t most = 1;
    for (const auto end : {&PoseGraphEdge::from, &PoseGraphEdge::to}) {
      const auto at = [&](std::size_t e) { return map.graph.edges[e].*end; };
      const auto [first, last] = std::ranges::minmax(group, {}, at);
      most = std::max(most, between(at(first), at(last)));
    }
    out.push_back(std::min(group.size(), static_cast<std::size_t>(most)));
  }
  return out;
}

/// Covariances of neighbouring spread nodes by odometry alone, which is as honest as `weights` make it, and disregarded
/// where it failed.
std::vector<Matrix6d> spread_odometry(const MapEstimate& map, std::span<const std::size_t> spread,
                                      std::span<const double> weights) {
  std::vector<Matrix6d> out(spread.size(), Matrix6d::Zero());
  // Odometry's edges are in the order of their ends; between submaps that are missing there is none, and no end to it.
  std::size_t e = 0;
  for (std::size_t k = 1; k < spread.size(); ++k) {
    std::size_t reached = spread[k - 1];
    while (e < map.odometry_edges && map.graph.edges[e].from < reached) ++e;
    for (; e < map.odometry_edges && map.graph.edges[e].to <= spread[k]; ++e) {
      const PoseGraphEdge& edge = map.graph.edges[e];
      if (edge.from != reached) break;
      const auto refined = map.odometry_of_steps.find(e);
      out[k] = compound_covariance(edge.T_from_to, out[k],
                                   refined == map.odometry_of_steps.end()
                                       ? Matrix6d(inverse_of(edge.information) / weights[e])
                                       : refined->second);
      reached = edge.to;
    }
    if (reached == spread[k]) continue;
    out[k].setZero();
    out[k].diagonal().head<3>().setConstant(kUnknownTranslation_m * kUnknownTranslation_m);
    out[k].diagonal().tail<3>().setConstant(kUnknownRotation_rad * kUnknownRotation_rad);
  }
  return out;
}

/// How sure the map is of the chains that robots were last seen in: nobody reads it of earlier sessions, of which there
/// are many after a day. The random numbers are always the same: the result is a function of the map. The posterior
/// goes when it is not needed any more: it is as large as what the closures' influence takes.
std::vector<ChainUncertainty> uncertainties(const MapEstimate& map, const PoseGraph& on_earth, const ProxyGraph& graph,
                                            const std::map<ChainId, std::vector<std::size_t>>& chosen,
                                            std::unique_ptr<const estimation::JointPosterior> posterior,
                                            std::span<const double> weights,
                                            const consistency::ProxyGraphConfig& config, MonitorWork& work) {
  struct Chain {
    std::size_t begin = 0, end = 0;  // in `kept`
    std::vector<std::size_t> spread;
    Eigen::MatrixXd covariance;
  };
  std::vector<std::size_t> kept;  // indices into map.nodes of the chains' nodes in the graph
  std::vector<Chain> chains;
  for (const LastSeen& seen : graph.last_seen) {
    const std::span<const ProxyNode> nodes = nodes_of(graph, seen.chain);
    Chain& chain = chains.emplace_back(Chain{.begin = kept.size(), .end = kept.size() + nodes.size()});
    auto node = nodes.begin();
    for (const std::size_t i : chosen.at(seen.chain)) {
      if (node == nodes.end() || node->stamp != map.nodes[i].stamp) continue;
      kept.push_back(i);
      ++node;
    }
    TUTTI_CHECK(kept.size() == chain.end, "{} of {} nodes found", kept.size() - chain.begin, nodes.size());
  }
  const Eigen::MatrixXd samples =
      posterior->samples(kept, static_cast<std::size_t>(config.shape_samples), Rng(0).fork("uncertainty"));
  std::vector<ChainUncertainty> out;
  if (!samples.allFinite()) return out;
  for (Chain& chain : chains) {
    for (const std::size_t node : ChainUncertainty::spread(chain.end - chain.begin))
      chain.spread.push_back(kept[chain.begin + node]);
    chain.covariance = posterior->covariance(chain.spread);
  }
  posterior.reset();
  ++work.factorisations;
  const Hinges hinges = hinges_of(map, on_earth, kept, static_cast<std::size_t>(config.shape_deletions));
  for (Chain& chain : chains) {
    const auto first = static_cast<Eigen::Index>(6 * chain.begin);
    const auto rows = static_cast<Eigen::Index>(6 * (chain.end - chain.begin));
    const auto of_chain = [&](const Eigen::MatrixXd& all) {  // what has no columns has no memory to point into either
      return all.cols() == 0 ? Eigen::MatrixXd(rows, 0) : Eigen::MatrixXd(all.middleRows(first, rows));
    };
    out.push_back(consistency::chain_uncertainty(graph, map.nodes[kept[chain.begin]].id.chain,
                                                 {.samples = of_chain(samples),
                                                  .shifts = of_chain(hinges.shifts),
                                                  .shift_places = places_of(map, hinges.groups, chain.spread),
                                                  .spread_covariance = std::move(chain.covariance),
                                                  .spread_odometry = spread_odometry(map, chain.spread, weights)},
                                                 &work.products));
  }
  return out;
}

/// Per edge: odometry counts as much as its closures show that it is worth.
std::vector<double> honest_weights(const MapEstimate& map, std::size_t edges) {
  std::vector<double> out(edges, 1.0);
  for (std::size_t e = 0; e < map.odometry_edges; ++e)
    if (const auto found = map.overstated.find(map.nodes[map.graph.edges[e].from].id.chain);
        found != map.overstated.end() && !map.odometry_of_steps.contains(e))
      out[e] = 1.0 / found->second;
  return out;
}

}  // namespace

std::unique_ptr<const estimation::JointPosterior> posterior_of(
    const MapEstimate& map, const PoseGraph& on_earth, std::span<const estimation::JointPosterior::Pair> pairs) {
  const std::vector<double> weights = honest_weights(map, on_earth.edges.size());
  return std::make_unique<const estimation::JointPosterior>(on_earth, on_earth.poses, pairs, weights);
}

ProxyGraph monitor_graph(const MapEstimate& map, std::uint64_t revision, const consistency::ProxyGraphConfig& config,
                         std::span<const ChainId> owners, MonitorWork* work) {
  MonitorWork unasked;
  MonitorWork& counted = work != nullptr ? *work : unasked;
  auto chosen = choose_nodes(map);
  std::vector<std::pair<std::size_t, std::size_t>> segments;
  for (const auto& [chain, nodes] : chosen) {
    for (std::size_t k = 1; k < nodes.size(); ++k) segments.emplace_back(nodes[k - 1], nodes[k]);
    for (const auto& [first, last] : repairs(map, chain, nodes)) segments.emplace_back(nodes[first], nodes[last]);
  }
  std::optional<PoseGraph> with_fixes;
  if (!map.fixes.edges.empty()) with_fixes = graph_on_earth(map);
  const PoseGraph& on_earth = with_fixes ? *with_fixes : map.graph;
  const std::vector<double> weights = honest_weights(map, on_earth.edges.size());
  auto posterior = posterior_of(map, on_earth, segments);
  ++counted.factorisations;
  const std::vector<Matrix6d> covariances = posterior->relative_covariances();

  std::vector<consistency::ServerNode> nodes;
  std::vector<ChainComponent> components;
  std::size_t segment = 0;
  for (auto& [chain, indices] : chosen) {
    bool determined = true;
    std::size_t next = segment;  // after this chain's
    for (; next < segments.size() && map.nodes[segments[next].first].id.chain == chain; ++next)
      determined = determined && check_covariance(covariances[next]);
    if (!determined) {  // its own edges leave its poses open, or nearly: it gets nothing, and the others do
      indices.clear();
      segment = next;
    }
    if (indices.empty()) continue;
    components.push_back({chain, map.nodes[indices.front()].component});
    const std::size_t first_node = nodes.size();
    for (std::size_t k = 0; k < indices.size(); ++k) {
      const MapNode& node = map.nodes[indices[k]];
      nodes.push_back({.chain = chain,
                       .stamp = node.stamp,
                       .T_world_body = node.T_world_body,
                       .covariance = k == 0 ? Matrix6d::Zero() : covariances[segment++]});
    }
    // Where odometry failed, the steps' errors are large but must add up to what the closures say, so they undo each
    // other, which a covariance per step cannot express. Equal shares of the whole segment's add up to the right sum.
    for (const auto& [first, last] : repairs(map, chain, indices)) {
      const Matrix6d share = covariances[segment++] / static_cast<double>(last - first);
      const Pose3& T_world_last = nodes[first_node + last].T_world_body;
      for (std::size_t k = first + 1; k <= last; ++k) {
        const Matrix6d to_node = adjoint(nodes[first_node + k].T_world_body.inverse() * T_world_last);
        const Matrix6d moved = to_node * share * to_node.transpose();
        nodes[first_node + k].covariance = 0.5 * (moved + moved.transpose());
      }
    }
  }
  ProxyGraph graph = consistency::build_proxy_graph(revision, std::move(nodes), std::move(components), config);
  for (const ChainId& owner : owners) consistency::see_last_in(graph, owner);
  if (config.shape_samples > 0)
    graph.uncertainties = uncertainties(map, on_earth, graph, chosen, std::move(posterior), weights, config, counted);
  return graph;
}

}  // namespace tutti::server
