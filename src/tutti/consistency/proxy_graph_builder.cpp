// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/proxy_graph_builder.hpp"

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/spectral/graph.hpp"
#include "tutti/spectral/kron.hpp"

namespace tutti::consistency {
namespace {

struct RobotRange {
  std::size_t begin = 0, end = 0;
  [[nodiscard]] std::size_t size() const { return end - begin; }
};

std::vector<RobotRange> robot_ranges(const std::vector<ServerNode>& nodes) {
  std::vector<RobotRange> ranges;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i == 0 || nodes[i].chain != nodes[i - 1].chain) ranges.push_back({i, i});
    ranges.back().end = i + 1;
  }
  return ranges;
}

// Largest remainder. Shares add up to the budget unless the ends of the robots alone exceed it: what small robots get
// beyond their share, for their ends, the largest shares give back.
std::vector<std::size_t> share_budget(std::size_t budget, const std::vector<RobotRange>& ranges, std::size_t nodes) {
  std::vector<std::size_t> share(ranges.size()), order(ranges.size());
  std::size_t spent = 0;
  for (std::size_t r = 0; r < ranges.size(); ++r) {
    share[r] = std::max(budget * ranges[r].size() / nodes, std::min<std::size_t>(2, ranges[r].size()));
    spent += share[r];
    order[r] = r;
  }
  for (; spent > budget; --spent) {
    const auto largest = std::ranges::max_element(share);
    if (*largest <= 2) break;
    --*largest;
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return budget * ranges[a].size() % nodes > budget * ranges[b].size() % nodes;
  });
  for (const std::size_t r : order) {
    if (spent >= budget) break;
    if (share[r] < ranges[r].size()) ++share[r], ++spent;
  }
  return share;
}

// Appends robot nodes[range] to `graph`, reduced to about `budget` nodes.
void append_reduced(ProxyGraph& graph, const std::vector<ServerNode>& nodes, RobotRange range, std::size_t budget,
                    const ProxyGraphConfig& config) {
  const int n = static_cast<int>(range.size());
  std::vector<Eigen::Vector3d> positions;
  for (std::size_t i = range.begin; i < range.end; ++i) positions.push_back(nodes[i].T_world_body.translation);
  const auto L = spectral::laplacian(spectral::proximity_adjacency(positions, config.radius_m, config.sigma_m));
  const std::vector<int> ends = n > 1 ? std::vector<int>{0, n - 1} : std::vector<int>{0};
  const std::vector<int> kept = config.reducer == "paper"
                                    ? spectral::select_largest_eigenvector(L, ends)
                                    : spectral::select_budget(L, positions, static_cast<int>(budget), ends);
  const auto reduced = spectral::sparsify(spectral::kron_reduce(L, kept).laplacian, config.sparsify_threshold);

  const auto offset = static_cast<std::uint32_t>(graph.nodes.size());
  Matrix6d covariance = Matrix6d::Zero();
  std::size_t next = 0;  // position in `kept`
  for (int i = 0; i < n; ++i) {
    const ServerNode& node = nodes[range.begin + static_cast<std::size_t>(i)];
    if (i > 0) {
      const ServerNode& previous = nodes[range.begin + static_cast<std::size_t>(i) - 1];
      const Pose3 T_previous_body = previous.T_world_body.inverse() * node.T_world_body;
      covariance = compound_covariance(T_previous_body, covariance, node.covariance);
    }
    if (next < kept.size() && kept[next] == i) {
      ++next;
      graph.nodes.push_back({node.chain, node.stamp, node.T_world_body, covariance});
      covariance = Matrix6d::Zero();
    } else {
      graph.eliminated.push_back({node.chain, node.stamp});
    }
  }
  for (int column = 0; column < reduced.outerSize(); ++column)
    for (spectral::SparseMatrix::InnerIterator entry(reduced, column); entry; ++entry)
      if (entry.row() < column && entry.value() < 0.0)
        graph.edges.push_back({offset + static_cast<std::uint32_t>(entry.row()),
                               offset + static_cast<std::uint32_t>(column), -entry.value()});
}

void note_last_seen(ProxyGraph& graph) {
  for (std::size_t i = 0; i < graph.nodes.size(); ++i) {
    const ProxyNode& node = graph.nodes[i];
    if (i + 1 == graph.nodes.size() || graph.nodes[i + 1].chain.robot != node.chain.robot)
      graph.last_seen.push_back({node.chain, node.stamp, node.T_world_body, {}});
  }
}

}  // namespace

ProxyGraph build_proxy_graph(std::uint64_t revision, std::vector<ServerNode> nodes,
                             std::vector<ChainComponent> components, const ProxyGraphConfig& config) {
  std::sort(nodes.begin(), nodes.end(), [](const ServerNode& a, const ServerNode& b) {
    return std::pair(a.chain, a.stamp) < std::pair(b.chain, b.stamp);
  });
  for (std::size_t i = 1; i < nodes.size(); ++i)
    TUTTI_CHECK(nodes[i - 1].chain != nodes[i].chain || nodes[i - 1].stamp != nodes[i].stamp, "robot {} stamp {} twice",
                to_string(nodes[i].chain), nodes[i].stamp.ns);
  std::sort(components.begin(), components.end(),
            [](const ChainComponent& a, const ChainComponent& b) { return a.chain < b.chain; });

  ProxyGraph graph{.revision = revision, .radius_m = config.radius_m, .sigma_m = config.sigma_m};
  graph.components = std::move(components);
  const auto ranges = robot_ranges(nodes);
  for (const RobotRange& range : ranges) nodes[range.begin].covariance.setZero();

  const auto budget = static_cast<std::size_t>(config.node_budget);
  if (budget == 0 || nodes.size() <= budget) {
    for (const ServerNode& node : nodes)
      graph.nodes.push_back({node.chain, node.stamp, node.T_world_body, node.covariance});
  } else {
    graph.reduced = true;
    const auto shares = share_budget(budget, ranges, nodes.size());
    for (std::size_t r = 0; r < ranges.size(); ++r) append_reduced(graph, nodes, ranges[r], shares[r], config);
  }
  note_last_seen(graph);
  return graph;
}

void see_last_in(ProxyGraph& graph, const ChainId& chain) {
  const std::span<const ProxyNode> nodes = nodes_of(graph, chain);
  if (nodes.empty()) return;
  for (LastSeen& seen : graph.last_seen)
    if (seen.chain.robot == chain.robot) seen = {chain, nodes.back().stamp, nodes.back().T_world_body, seen.name};
}

ProxyGraph own_part(const ProxyGraph& whole, RobotId robot) {
  ProxyGraph own{.epoch = whole.epoch,
                 .revision = whole.revision,
                 .incarnation = whole.incarnation,
                 .radius_m = whole.radius_m,
                 .sigma_m = whole.sigma_m,
                 .reduced = whole.reduced};
  const auto self = std::ranges::find(whole.last_seen, robot, [](const LastSeen& seen) { return seen.chain.robot; });
  if (self == whole.last_seen.end()) return own;
  const ChainId chain = self->chain;
  const auto of_chain = [&](const auto& value) { return value.chain == chain; };
  const std::span<const ProxyNode> nodes = nodes_of(whole, chain);
  own.nodes.assign(nodes.begin(), nodes.end());
  const auto first = static_cast<std::size_t>(nodes.data() - whole.nodes.data());
  for (const ProxyEdge& edge : whole.edges)
    if (first <= edge.a && edge.a < first + nodes.size())
      own.edges.push_back(
          {edge.a - static_cast<std::uint32_t>(first), edge.b - static_cast<std::uint32_t>(first), edge.weight});
  std::ranges::copy_if(whole.eliminated, std::back_inserter(own.eliminated), of_chain);
  std::ranges::copy_if(whole.uncertainties, std::back_inserter(own.uncertainties), of_chain);

  const auto component = component_of(whole, chain);
  std::ranges::copy_if(whole.last_seen, std::back_inserter(own.last_seen), [&](const LastSeen& seen) {
    return seen.chain != chain && component_of(whole, seen.chain) == component;
  });
  std::ranges::copy_if(whole.components, std::back_inserter(own.components), [&](const ChainComponent& entry) {
    return of_chain(entry) ||
           std::ranges::any_of(own.last_seen, [&](const auto& seen) { return seen.chain == entry.chain; });
  });
  return own;
}

}  // namespace tutti::consistency
