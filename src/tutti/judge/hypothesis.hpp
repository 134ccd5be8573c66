// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/chain_reduction.hpp"
#include "tutti/judge/explain_closures.hpp"

namespace tutti::judge {

/// Neighbouring runs of odometry that may be let go, by number.
struct Window {
  std::size_t first = 0;
  std::size_t last = 0;  ///< Inclusive.
};

struct Hypothesis {
  std::vector<Window> windows;                  ///< In order; none overlap. Of a solution: that let something go.
  std::vector<std::vector<std::size_t>> wrong;  ///< Groups of closures.
};

/// What a hypothesis makes of the closures. Votes: closures that end at one keyframe share one.
struct Solution {
  Hypothesis hypothesis;
  bool solved = false;
  std::vector<char> let_go;           ///< Per run.
  std::vector<char> accepted;         ///< Per closure.
  std::vector<FailedStretch> failed;  ///< Runs let go, neighbours together; nodes of the graph.
  estimation::GncResult optimum;      ///< On the graph of the closures' ends.
  double misfit = 0.0;                ///< In votes, with what windows and wrong groups pay.
  double fit = 0.0;                   ///< The misfit without what windows pay.
  std::vector<double> prices;         ///< What of the misfit each window pays; infinite where one failed too far.
  bool suspicious = false;            ///< More than wrong closures strewn about may be behind what is unexplained.
  double unexplained = 0.0;  ///< Votes of refused closures, and what strains one window of odometry beyond chance.
};

/// Solves a pose graph under hypotheses, on the graph of the closures' ends.
class HypothesisSolver {
 public:
  /// All must outlive this. `certain`: of each closure, whether it is right whatever it strains.
  HypothesisSolver(const PoseGraph& graph, const OdometryWays& odometry, std::size_t odometry_edges,
                   const WhoIsWrongConfig& config, const estimation::GncConfig& gnc, std::vector<bool> certain);

  [[nodiscard]] Solution solve(Hypothesis hypothesis) const;
  /// Prices a hypothesis at an optimum that was found for another one, without solving again. This is exact where both
  /// hypotheses refuse the same groups and the optimum lets odometry go within `hypothesis`'s windows only: the optimum
  /// is then this hypothesis's own, because it may let nothing else go.
  [[nodiscard]] Solution judge(Hypothesis hypothesis, estimation::GncResult optimum) const;
  [[nodiscard]] std::size_t runs() const { return runs_.size(); }
  /// The runs around one, within the search distance on its piece.
  [[nodiscard]] Window around(std::size_t run) const;
  /// So far.
  [[nodiscard]] const SearchWork& work() const { return work_; }
  [[nodiscard]] double votes(std::size_t closure) const { return votes_[closure]; }

 private:
  [[nodiscard]] std::size_t begin_of(std::size_t run) const;
  [[nodiscard]] std::size_t end_of(std::size_t run) const;
  void count_votes();
  void find_failed(const std::vector<Pose3>& poses, Solution& out) const;
  [[nodiscard]] double votes_for(const FailedStretch& failed) const;

  const OdometryWays& odometry_;
  const WhoIsWrongConfig& config_;
  const estimation::GncConfig& gnc_;
  double limit_;
  estimation::ReducedGraph reduced_;
  estimation::PoseGraphSolution all_held_;  // with nothing let go or refused, where every solution begins
  std::vector<std::size_t> runs_;           // edges of the reduced graph, by their begin
  std::vector<std::size_t> closures_;       // edges of the reduced graph
  std::vector<bool> certain_;               // per closure
  std::vector<double> votes_;               // per closure
  mutable SearchWork work_;
};

}  // namespace tutti::judge
