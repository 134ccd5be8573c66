// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <utility>

#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/consistency/policy.hpp"
#include "tutti/robot/agent.hpp"

/// Other ways to choose constraints, against which the product's policies are measured.
namespace tutti::lab {

/// A policy that uses all of its budget; other policies know when to stop.
class BudgetedPolicy : public consistency::ConstraintPolicy {
 public:
  explicit BudgetedPolicy(std::size_t budget) : budget_(budget) {}
  /// Sets how many constraints the robot may keep after the next update.
  void set_budget(std::size_t constraints) { budget_ = constraints; }

 protected:
  [[nodiscard]] std::size_t budget() const { return budget_; }

 private:
  std::size_t budget_;
};

/// `uniform`: a chain of equally long links (in nodes) from the first node to the last, min(budget, nodes - 1) of them.
class UniformPolicy final : public BudgetedPolicy {
 public:
  explicit UniformPolicy(std::size_t budget) : BudgetedPolicy(budget) {}
  [[nodiscard]] consistency::Selection choose(const consistency::PolicyInput& input) const override;
};

/// `random`: draws node and kind with replacement and takes the links of that kind at the node, until the budget is
/// used (or, on a small graph, no new links turn up).
class RandomPolicy final : public BudgetedPolicy {
 public:
  /// `rng` is forked by the map's revision at every update.
  RandomPolicy(std::size_t budget, Rng rng) : BudgetedPolicy(budget), rng_(std::move(rng)) {}
  [[nodiscard]] consistency::Selection choose(const consistency::PolicyInput& input) const override;

 private:
  Rng rng_;
};

/// `every_node_2`, the paper's denser baseline: every node is linked to the next two.
class EveryNode2Policy final : public consistency::ConstraintPolicy {
 public:
  [[nodiscard]] consistency::Selection choose(const consistency::PolicyInput& input) const override;
};

/// `skeleton`: links that span runs of nodes, as long as the disagreement allows. It begins with one link over the
/// whole run; where the robot's raw chain, spread between the links' ends, is farthest from the server's map, it splits
/// a link in two, the worst one first, until every node is within `tolerance_m`. It starts from raw odometry at every
/// update and replaces all constraints; a robot that agrees with the map gets none.
class SkeletonPolicy final : public consistency::ConstraintPolicy {
 public:
  explicit SkeletonPolicy(double tolerance_m = 0.01) : tolerance_m_(tolerance_m) {}
  [[nodiscard]] consistency::Selection choose(const consistency::PolicyInput& input) const override;

 private:
  double tolerance_m_;
};

/// One of these policies, or of the product's with the robot's settings. Fails with ErrorCode::configuration when there
/// is none of this name.
Result<std::unique_ptr<consistency::ConstraintPolicy>> make_policy(const std::string& name,
                                                                   const robot::AgentConfig& config, const Rng& rng);

}  // namespace tutti::lab
