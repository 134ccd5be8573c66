// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/consistency/policy.hpp"

namespace tutti::consistency::internal {

/// No feedback: what a robot is without Tutti.
class NonePolicy final : public ConstraintPolicy {
 public:
  [[nodiscard]] Selection choose(const PolicyInput&) const override { return {}; }
};

/// The paper's baseline: every node linked to the next, whatever the difference of the two maps.
class EveryNodePolicy final : public ConstraintPolicy {
 public:
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;
};

/// The paper's: compare() measures how much the two maps disagree at every node and scale, links_where() decides what
/// is done about it.
class SpectralPolicy final : public ConstraintPolicy {
 public:
  SpectralPolicy(const PolicyConfig& config, const CompareConfig& compare) : config_(config), compare_(compare) {}
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  PolicyConfig config_;
  CompareConfig compare_;
};

/// Step 6 of the paper. `disagreement`: pairs x scales, m (Comparison). Per node, summed over a group of scales,
/// against the group's threshold; small-scale -> links to the direct neighbours, mid-scale -> mid_hops away,
/// large-scale -> to the nearest submaps. Adds to what is there. The largest disagreement over its threshold comes
/// first within a group, groups take turns.
Selection links_where(const PolicyInput& input, const Eigen::MatrixXd& disagreement, const PolicyConfig& config);

/// Nothing while raw odometry differs from the server's map only within the server's uncertainty (DisagreementTest).
/// Once it differs by more: a chain of links over the whole run, fixed where the server has its ends; a run is
/// split where odometry bent to the links is predicted to be farther from the map than `adaptive_error_share` of what
/// the map itself is unsure of there, and where the same test still sees a difference. So the lengths of links follow
/// the scale of the disagreement. Planned afresh at every update; no links again once odometry agrees well within the
/// threshold, as after a wrong closure is gone.
class AdaptivePolicy final : public ConstraintPolicy {
 public:
  explicit AdaptivePolicy(const PolicyConfig& config) : config_(config) {}
  [[nodiscard]] bool needs_test() const override { return true; }
  [[nodiscard]] Selection choose(const PolicyInput& input) const override;

 private:
  static constexpr double kLeastError_m = 1e-3;  ///< Poses on the wire are rounded to half of it.
  static constexpr double kRelease = 0.5;        ///< Share of the threshold below which kept links are released.
  PolicyConfig config_;
};

}  // namespace tutti::consistency::internal
