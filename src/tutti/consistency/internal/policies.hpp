// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/consistency/policy.hpp"

namespace tutti::consistency::internal {

/// No feedback: what a robot is without Tutti.
class NonePolicy final : public ConstraintPolicy {
 public:
  [[nodiscard]] std::string name() const override { return "none"; }
  [[nodiscard]] Selection choose(const PolicyInput&) const override { return {}; }
};

/// The paper's baseline: node i linked to i + 1, ..., i + reach (reach 1 or 2), whatever the comparison says. The
/// budget is not looked at.
class EveryNodePolicy final : public ConstraintPolicy {
 public:
  EveryNodePolicy(int reach, const PolicyConfig& config) : reach_(reach), config_(config) {}
  [[nodiscard]] std::string name() const override { return reach_ == 1 ? "every_node" : "every_node_2"; }
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  int reach_;
  PolicyConfig config_;
};

/// The paper's: per node, the disagreement summed over a group of scales against the group's threshold; small-scale ->
/// links to the direct neighbours, mid-scale -> mid_hops away, large-scale -> to the nearest submaps. Adds to what is
/// there. The largest disagreement over its threshold comes first within a group, groups take turns; this decides what
/// a budget buys.
class SpectralPolicy final : public ConstraintPolicy {
 public:
  explicit SpectralPolicy(const PolicyConfig& config) : config_(config) {}
  [[nodiscard]] std::string name() const override { return "spectral"; }
  [[nodiscard]] bool needs_disagreement() const override { return true; }
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  PolicyConfig config_;
};

/// A chain of equally long links (in nodes) from the first node to the last: min(budget, nodes - 1) of them.
class UniformPolicy final : public ConstraintPolicy {
 public:
  explicit UniformPolicy(const PolicyConfig& config) : config_(config) {}
  [[nodiscard]] std::string name() const override { return "uniform"; }
  [[nodiscard]] bool needs_budget() const override { return true; }
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  PolicyConfig config_;
};

/// Draws node and kind with replacement, takes the links of that kind there, until `budget` different links are found
/// (or, on a small graph, no new ones turn up).
class RandomPolicy final : public ConstraintPolicy {
 public:
  explicit RandomPolicy(const PolicyConfig& config) : config_(config) {}
  [[nodiscard]] std::string name() const override { return "random"; }
  [[nodiscard]] bool needs_budget() const override { return true; }
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  PolicyConfig config_;
};

/// Links that span runs of nodes, as long as the disagreement allows: one link over the whole run first; where the
/// robot's raw chain, spread between the links' ends, is farthest from the server's map, a link is split in two; worst
/// run first, until every node is within `skeleton_tolerance_m` (or the budget is used up). Chosen anew from raw
/// odometry at every update, so it replaces all; a robot that agrees as it is gets none.
class SkeletonPolicy final : public ConstraintPolicy {
 public:
  explicit SkeletonPolicy(const PolicyConfig& config) : config_(config) {}
  [[nodiscard]] std::string name() const override { return "skeleton"; }
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  PolicyConfig config_;
};

/// Nothing while raw odometry differs from the server's map only within the server's uncertainty (DisagreementTest).
/// Once it has been told otherwise: a chain of links over the whole run, held where the server has its ends; a run is
/// split where odometry bent to the links is predicted to be farther from the map than `adaptive_error_share` of what
/// the map itself is unsure of there, and where the same test still sees a difference. So the lengths of links follow
/// the scale of the disagreement. Planned afresh at every update; no links again once odometry agrees well within the
/// threshold, as after a wrong closure is gone.
class AdaptivePolicy final : public ConstraintPolicy {
 public:
  explicit AdaptivePolicy(const PolicyConfig& config) : config_(config) {}
  [[nodiscard]] std::string name() const override { return "adaptive"; }
  [[nodiscard]] bool needs_test() const override { return true; }
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  static constexpr double kLeastError_m = 1e-3;  ///< Poses on the wire are rounded to half of it.
  static constexpr double kLetGo = 0.5;          ///< Share of the threshold below which links held are given up.
  PolicyConfig config_;
};

}  // namespace tutti::consistency::internal
