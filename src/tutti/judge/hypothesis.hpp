// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/chain_reduction.hpp"
#include "tutti/judge/explain_closures.hpp"

namespace tutti::judge {

/// Consecutive runs, by number, that may be disregarded together. A run is a segment of odometry between two
/// neighbouring ends of closures.
struct Window {
  std::size_t first = 0;
  std::size_t last = 0;  ///< Inclusive.
};

/// An assumption about what is wrong: odometry may be disregarded in these windows alone, and these closures are wrong.
struct Hypothesis {
  std::vector<Window> windows;  ///< In order; none overlap. In a Solution only those in which something was
                                ///< disregarded.
  std::vector<std::vector<std::size_t>> wrong;  ///< Groups of closures that are wrong for certain.
};

/// The pose graph solved under a hypothesis, and what follows for the closures. Misfits are in votes, of which closures
/// that end at one keyframe share one.
struct Solution {
  Hypothesis hypothesis;
  bool solved = false;
  std::vector<char> disregarded;  ///< Per run.
  std::vector<char> accepted;     ///< Per closure.
  /// Runs that were disregarded, neighbours joined; `from` and `to` are nodes of the graph.
  std::vector<FailedSegment> failed;
  estimation::GncResult optimum;  ///< On the graph of the closures' ends.
  double misfit = 0.0;            ///< With the prices of windows and of wrong groups.
  double fit = 0.0;               ///< The misfit without the prices of windows.
  std::vector<double> prices;  ///< Per window its part of the misfit; infinite where odometry would have failed by more
                               ///< than a body can move.
  /// Votes of refused closures, plus the largest strain beyond chance on one window of odometry.
  double unexplained = 0.0;
};

/// Where a segment failed: far from where odometry turned wrongly, the failure would have to be larger.
FailedSegment narrowed(const OdometryTrajectories& odometry, FailedSegment failed);

/// Whether a body can have moved by what odometry missed there.
bool is_possible(const OdometryTrajectories& odometry, const FailedSegment& failed);

/// Solves a pose graph under hypotheses, on the graph of the closures' ends.
class HypothesisSolver {
 public:
  /// `odometry`, `config` and `gnc` must outlive the solver. `graph`, `odometry_edges`: as in explain_closures().
  /// `certain`: per closure whether it is right whatever it strains.
  HypothesisSolver(const PoseGraph& graph, const OdometryTrajectories& odometry, std::size_t odometry_edges,
                   const OutlierRejectionConfig& config, const estimation::GncConfig& gnc, std::vector<bool> certain);

  [[nodiscard]] Solution solve(Hypothesis hypothesis) const;
  /// Prices a hypothesis at an optimum that was found for another one, without solving again. This is exact where both
  /// hypotheses refuse the same groups and the optimum disregards odometry within `hypothesis`'s windows only: the
  /// optimum is then this hypothesis's own, because it may disregard nothing else.
  [[nodiscard]] Solution judge(Hypothesis hypothesis, estimation::GncResult optimum) const;
  [[nodiscard]] std::size_t runs() const { return runs_.size(); }
  /// The runs within config.search_s of a run, on the same segment of odometry.
  [[nodiscard]] Window around(std::size_t run) const;
  /// The runs over which odometry stood still for so long that it may have lost itself: wheels in the air, a front end
  /// that repeats its last pose. The longest first.
  [[nodiscard]] std::vector<Window> standstills() const;
  /// Cost of all calls so far.
  [[nodiscard]] const SearchWork& work() const { return work_; }
  [[nodiscard]] double votes(std::size_t closure) const { return votes_[closure]; }

 private:
  [[nodiscard]] std::size_t begin_of(std::size_t run) const;
  [[nodiscard]] std::size_t end_of(std::size_t run) const;
  void count_votes();
  void find_failed(const std::vector<Pose3>& poses, Solution& out) const;
  [[nodiscard]] double votes_for(const FailedSegment& failed) const;

  const OdometryTrajectories& odometry_;
  const OutlierRejectionConfig& config_;
  const estimation::GncConfig& gnc_;
  double limit_;
  estimation::ReducedGraph reduced_;
  estimation::PoseGraphSolution all_kept_;  // with nothing disregarded or refused, where every solution begins
  std::vector<std::size_t> runs_;           // edges of the reduced graph, by their begin
  std::vector<std::size_t> closures_;       // edges of the reduced graph
  std::vector<bool> certain_;               // per closure
  std::vector<double> votes_;               // per closure
  mutable SearchWork work_;
};

}  // namespace tutti::judge
