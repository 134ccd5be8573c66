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

/// Ranks nodes by ||x_server - x_robot|| after laying node 0 of one on node 0 of the other; small- and mid-kind links
/// to the largest first. Adds to what is there, up to the budget; without one, to every node above the threshold.
class EuclideanPolicy final : public ConstraintPolicy {
 public:
  explicit EuclideanPolicy(const PolicyConfig& config) : config_(config) {}
  [[nodiscard]] std::string name() const override { return "euclidean"; }
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

struct TimeChain;
struct JointPlan;
class OdometryError;

/// Nothing while the robot's estimate differs from the server's only within the server's uncertainty (ChainAgreement).
/// Once it has been told otherwise: the links that pay, bending raw odometry to the server's map (place_joints: each
/// lowers the summed squared disagreement by `least_gain` nodes' worth of the server's own variance), so that their
/// lengths follow the scale of the disagreement and their ends lie where drift was born; and more where what is left
/// stands out at any scale. Planned afresh at every update; held links stay, measured anew in the newest map, unless
/// the new plan is better by a link's worth, or does without any, as after a wrong closure is gone and the map has come
/// back to raw odometry.
class AdaptivePolicy final : public ConstraintPolicy {
 public:
  explicit AdaptivePolicy(const PolicyConfig& config) : config_(config) {}
  [[nodiscard]] std::string name() const override { return "adaptive"; }
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  static constexpr double kLeastRmse_m = 2e-3;  ///< Poses on the wire are rounded to a quarter of it.
  static constexpr double kRmseFactor = 3.0;
  // What a radian counts: where links go, positions decide; how joints are turned, what that does to 10 m around them.
  static constexpr double kPlacingLever_m = 0.3;
  static constexpr double kFittingLever_m = 2.0;
  [[nodiscard]] bool disagree(const ChainAgreement& test, const TimeChain& chain, double expected_rmse_m) const;
  [[nodiscard]] JointPlan plan(const TimeChain& chain, const OdometryError& fitting, const ChainAgreement& test,
                               std::size_t most, double least_gain) const;
  PolicyConfig config_;
};

}  // namespace tutti::consistency::internal
