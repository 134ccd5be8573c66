// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/random.hpp"
#include "tutti/base/result.hpp"
#include "tutti/consistency/compare.hpp"
#include "tutti/consistency/constraint.hpp"
#include "tutti/consistency/disagreement.hpp"
#include "tutti/consistency/ledger.hpp"

namespace tutti::consistency {

/// Everything a policy may look at. References live only for the call.
struct PolicyInput {
  const ProxyGraph& graph;
  ChainId chain;
  std::span<const RobotNode> nodes;
  const Comparison& comparison;  ///< Only synchronised unless needs_disagreement().
  /// How many constraints the robot may hold after this update; existing ones are counted, never taken away by a policy
  /// that adds to them. None: the policy's own rule.
  std::optional<std::size_t> budget;
  Rng rng;
  const Ledger& ledger;
  /// Of raw odometry against the server's map; null: fewer than two synchronised nodes, or nobody asked.
  const DisagreementTest* test = nullptr;
  const Disagreement* odometry_disagreement = nullptr;  ///< What it says.
};

struct Selection {
  std::vector<Constraint> constraints;
  bool replaces_all = false;  ///< False: added to (or refreshing) the ledger. True: the ledger is to hold just these.
};

/// How constraints are chosen. Implementations are immutable values; same input, same selection.
class ConstraintPolicy {
 public:
  virtual ~ConstraintPolicy() = default;
  [[nodiscard]] virtual std::string name() const = 0;
  /// Spends whatever it is given; the others know when to stop.
  [[nodiscard]] virtual bool needs_budget() const { return false; }
  /// Looks at PolicyInput::comparison.disagreement, which is costly: others go without.
  [[nodiscard]] virtual bool needs_disagreement() const { return false; }
  /// Looks at PolicyInput::test.
  [[nodiscard]] virtual bool needs_test() const { return false; }
  [[nodiscard]] virtual Selection choose(const PolicyInput& input) const = 0;
};

/// The thresholds of `spectral` were set once, on simulated corridor missions (bench/runtime/closed_loop.cpp, five
/// seeds: 1295 nodes in one hour, an update every 7 nodes, onboard error 1.1-2.3 m, server's own error 0.07 m), so that
/// it adds the paper's share of constraints: 728-784, 2.6 % of 29,152 odometry factors, agreement with the server
/// 0.04-0.07 m. The large group does the work (alone, at 0.1: 1300 links and 0.02 m; at 0.3: 540 and 0.06 m); the small
/// group repairs bends within a submap (60 m with 0.3 degrees of yaw drift per metre: 0.7 m -> 0.010-0.016 m); the mid
/// group hardly speaks unless something is badly wrong.
struct PolicyConfig {
  std::string name = "adaptive";
  std::string classifier = "thresholds";
  double threshold_large_m = 0.25;
  double threshold_mid_m = 0.5;
  double threshold_small_m = 0.2;
  int top_count = 10;
  double top_threshold_m = 0.07;
  int mid_hops = 5;         ///< Mid-scale links go this many nodes back and forth in time.
  int nearest_submaps = 4;  ///< Large-scale links go to this many submaps.
  int default_budget = 25;  ///< uniform and random: constraints held when no budget is given.
  /// skeleton: links are split until every node is this close to the server's map.
  double skeleton_tolerance_m = 0.01;
  double adaptive_error_share = 0.25;

  template <class V>
  void describe(V& v) {
    v.field("name", name,
            one_of({"none", "every_node", "every_node_2", "spectral", "uniform", "random", "skeleton", "adaptive"}),
            "How a robot chooses constraints; 'spectral' is the paper's, 'adaptive' the product's default, "
            "'none' leaves it alone.");
    v.field("classifier", classifier, one_of({"thresholds", "top"}),
            "spectral: label nodes above a threshold per group (the paper) or the largest ones (the authors' code).");
    v.field("threshold_large_m", threshold_large_m, at_least(0.0),
            "spectral: summed disagreement of scales 0-1 above which a node gets links to the nearest submaps.");
    v.field("threshold_mid_m", threshold_mid_m, at_least(0.0),
            "spectral: summed disagreement of scales 2-3 above which a node gets links mid_hops away.");
    v.field("threshold_small_m", threshold_small_m, at_least(0.0),
            "spectral: summed disagreement of the other scales above which a node gets links to its neighbours.");
    v.field("top_count", top_count, at_least(1.0), "spectral, classifier top: nodes labelled per update.");
    v.field("top_threshold_m", top_threshold_m, at_least(0.0), "spectral, classifier top: and only above this.");
    v.field("adaptive_error_share", adaptive_error_share, greater_than(0.0),
            "adaptive: once robot and map disagree, links are split until every node is this close to the map, as a "
            "share of what the map itself is unsure of there.");
  }
};

/// Fails with ErrorCode::configuration when `name` is none of the above (config.name is not looked at).
Result<std::unique_ptr<ConstraintPolicy>> make_policy(const std::string& name, const PolicyConfig& config);

}  // namespace tutti::consistency
