// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/base/rows.hpp"
#include "tutti/consistency/compare.hpp"
#include "tutti/consistency/constraint.hpp"
#include "tutti/consistency/disagreement.hpp"
#include "tutti/consistency/ledger.hpp"
#include "tutti/consistency/synchronise.hpp"

namespace tutti::consistency {

/// Everything that a policy may use. The references are valid during the call only.
struct PolicyInput {
  const ProxyGraph& graph;
  ChainId chain;
  std::span<const RobotNode> nodes;
  std::span<const NodePair> pairs;  ///< The synchronised nodes, in time order.
  const Ledger& ledger;
  /// The test of raw odometry against the server's map. Null when there are fewer than two synchronised nodes, or when
  /// nobody needs it.
  const DisagreementTest* test = nullptr;
  const Disagreement* odometry_disagreement = nullptr;  ///< The result of the test; null with it.
};

/// The constraints that a policy chooses.
struct Selection {
  std::vector<Constraint> constraints;
  /// True: the ledger shall keep these and no others. False: they are added to the ledger, or refresh it.
  bool replaces_all = false;
  int order = 0;  ///< Polynomial order of the comparison that was made; 0: exact, or none was made.
};

/// Chooses which constraints the robot takes from the map: where, and at which scale. A function of its input only.
class ConstraintPolicy {
 public:
  virtual ~ConstraintPolicy() = default;
  /// True if choose() uses PolicyInput::test.
  [[nodiscard]] virtual bool needs_test() const { return false; }
  [[nodiscard]] virtual Selection choose(const PolicyInput& input) const = 0;
};

struct PolicyConfig;
/// A policy that can be chosen.
struct PolicyKind {
  std::string_view name;
  std::string_view help;
  /// `compare` is used by `spectral`.
  std::unique_ptr<ConstraintPolicy> (*make)(const PolicyConfig& config, const CompareConfig& compare);
};
const std::vector<PolicyKind>& policies();

/// Which policy, and its parameters. The thresholds of `spectral` were set once, on simulated corridor missions
/// (bench/runtime/closed_loop.cpp; five seeds with 1295 nodes in one hour, an update every 7 nodes, onboard
/// error 1.1-2.3 m, the server's own error 0.07 m), so that it adds the paper's share of constraints: 728-784, which
/// is 2.6 % of 29,152 odometry factors, and agrees with the server to 0.04-0.07 m. Most of the effect is from the large
/// group (alone, with a threshold of 0.1: 1300 constraints and 0.02 m; of 0.3: 540 and 0.06 m). The small group repairs
/// bends within a submap (60 m with 0.3 degrees of yaw drift per metre: 0.7 m -> 0.010-0.016 m). The mid group rarely
/// exceeds its threshold.
struct PolicyConfig {
  std::string name = "adaptive";
  std::string classifier = "thresholds";
  double threshold_large_m = 0.25;
  double threshold_mid_m = 0.5;
  double threshold_small_m = 0.2;
  int top_count = 10;             ///< classifier top: nodes labelled per update,
  double top_threshold_m = 0.07;  ///< and only above this.
  int mid_hops = 5;               ///< Mid-scale links go this many nodes back and forth in time.
  int nearest_submaps = 4;        ///< Large-scale links go to this many submaps.
  double adaptive_error_share = 0.25;

  template <class V>
  void describe(V& v) {
    v.field("name", name, one_of(names_of(policies())),
            "How a robot chooses constraints. " + help_of(policies()) + ".");
    v.field("classifier", classifier, one_of({"thresholds", "top"}),
            "spectral: label nodes above a threshold per group (the paper) or the largest ones (the authors' code).");
    v.field("threshold_large_m", threshold_large_m, at_least(0.0),
            "spectral: summed disagreement of scales 0-1 above which a node gets links to the nearest submaps.");
    v.field("threshold_mid_m", threshold_mid_m, at_least(0.0),
            "spectral: summed disagreement of scales 2-3 above which a node gets links mid_hops away.");
    v.field("threshold_small_m", threshold_small_m, at_least(0.0),
            "spectral: summed disagreement of the other scales above which a node gets links to its neighbours.");
    v.field("adaptive_error_share", adaptive_error_share, greater_than(0.0),
            "adaptive: once robot and map disagree, links are split until every node is this close to the map, as a "
            "share of what the map itself is unsure of there.");
  }
};

/// The policy named `config.name`. Fails with ErrorCode::configuration when the product has none of this name.
Result<std::unique_ptr<ConstraintPolicy>> make_policy(const PolicyConfig& config, const CompareConfig& compare);

}  // namespace tutti::consistency
