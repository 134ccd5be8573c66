// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "tutti/consistency/policy.hpp"

namespace tutti::consistency::internal {

/// Two synchronised nodes to be linked, by position in Comparison::pairs.
struct Link {
  std::size_t a = 0;
  std::size_t b = 0;
};

/// The synchronised node with this stamp.
std::optional<std::size_t> node_at(const PolicyInput& input, Timestamp stamp);

/// Which nodes a node is linked to, per kind (step 6 of the method).
class Neighbourhood {
 public:
  Neighbourhood(const PolicyInput& input, const PolicyConfig& config);

  /// small: the node and its direct neighbours in time. mid: the node and those `mid_hops` before and after. large: the
  /// node's submap and the `nearest_submaps` others whose centroids (server's estimate, over their synchronised nodes)
  /// are nearest to its own, each submap linked at its first synchronised node: nodes of one submap ask for the same
  /// links.
  [[nodiscard]] std::vector<Link> links(std::size_t node, ConstraintKind kind) const;

 private:
  [[nodiscard]] std::vector<Link> hop_links(std::size_t node, std::size_t hops) const;
  [[nodiscard]] std::vector<Link> submap_links(std::size_t node) const;

  struct SubmapPlace {
    Eigen::Vector3d centroid_world;
    std::size_t first = 0;  // node
  };
  std::vector<Eigen::Vector3d> positions_world_;
  std::vector<std::size_t> submap_of_;  // position in submaps_
  std::vector<SubmapPlace> submaps_;
  std::size_t mid_hops_, nearest_submaps_;
};

/// Collects links between nodes, each pair once, until the budget is used up.
class LinkCollector {
 public:
  /// `from_scratch`: the ledger's constraints do not count (the selection will replace them all).
  LinkCollector(const PolicyInput& input, bool from_scratch);

  [[nodiscard]] bool full() const { return input_.budget && held_ + added_ >= *input_.budget; }
  /// Ignored when full, or when the two nodes are linked already (here, or in the ledger unless from scratch).
  void add(Link link, ConstraintKind kind);
  void add(const std::vector<Link>& links, ConstraintKind kind);
  /// The new constraints; unless from scratch, before them every held constraint whose nodes are synchronised, measured
  /// again in the newest map: the ledger then decides whether it differs enough.
  [[nodiscard]] Selection take() &&;

 private:
  const PolicyInput& input_;
  ConstraintMaker maker_;
  bool from_scratch_;
  std::size_t held_ = 0, added_ = 0;
  std::set<std::pair<std::size_t, std::size_t>> linked_;
  Selection selection_;
};

}  // namespace tutti::consistency::internal
