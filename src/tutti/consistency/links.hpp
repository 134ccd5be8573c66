// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "tutti/consistency/policy.hpp"

namespace tutti::consistency {

/// Two synchronised nodes to be joined by a constraint; `a` and `b` index PolicyInput::pairs.
struct Link {
  std::size_t a = 0;
  std::size_t b = 0;
};

/// The position in PolicyInput::pairs of the node with this stamp.
std::optional<std::size_t> node_at(const PolicyInput& input, Timestamp stamp);

/// The nodes to which a node is linked, for each kind of constraint (step 6 of the paper's method).
class Neighbourhood {
 public:
  Neighbourhood(const PolicyInput& input, const PolicyConfig& config);

  /// For `small`, the node and its direct neighbours in time. For `mid`, the node and those up to `mid_hops` before and
  /// after it. For `large`, the node's submap and the `nearest_submaps` others whose centroids (of their synchronised
  /// nodes, in the server's estimate) are nearest; each submap is linked at its first synchronised node, so all nodes
  /// of a submap ask for the same links.
  [[nodiscard]] std::vector<Link> links(std::size_t node, ConstraintKind kind) const;

 private:
  [[nodiscard]] std::vector<Link> hop_links(std::size_t node, std::size_t hops) const;
  [[nodiscard]] std::vector<Link> submap_links(std::size_t node) const;

  struct SubmapPlace {
    Eigen::Vector3d centroid_world;
    std::size_t first = 0;  // node
  };
  std::vector<Eigen::Vector3d> positions_world_;
  std::vector<std::size_t> submap_of_;  // index into submaps_
  std::vector<SubmapPlace> submaps_;
  std::size_t mid_hops_, nearest_submaps_;
};

/// Collects links between nodes as constraints, each pair of nodes once.
class LinkCollector {
 public:
  /// `from_scratch` ignores the ledger's constraints, because the selection will replace them all.
  LinkCollector(const PolicyInput& input, bool from_scratch);

  /// Number of links that were added here.
  [[nodiscard]] std::size_t size() const { return added_; }
  /// Does nothing when the two nodes are linked already (here, or in the ledger unless from scratch).
  void add(Link link, ConstraintKind kind);
  void add(const std::vector<Link>& links, ConstraintKind kind);
  /// The new constraints. Unless from scratch they follow every kept constraint whose nodes are synchronised, made
  /// again from the newest map; the ledger then decides whether it differs enough.
  [[nodiscard]] Selection take() &&;

 private:
  ConstraintMaker maker_;
  std::size_t added_ = 0;
  std::set<std::pair<std::size_t, std::size_t>> linked_;
  Selection selection_;
};

}  // namespace tutti::consistency
