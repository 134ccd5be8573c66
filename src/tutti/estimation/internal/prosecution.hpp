// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "tutti/estimation/internal/consistency_cells.hpp"
#include "tutti/estimation/odometry_trial.hpp"

namespace tutti::estimation::internal {

/// What letting a stretch go would change.
struct Charge {
  std::size_t chain = 0;
  Cut cut;
  int gained = 0;  ///< Closures that would agree.
  int lost = 0;    ///< Closures that agree now and would no longer.
  Pose3 missed;    ///< What the odometry would have missed, seen at cut.to.
  double jump_m = 0.0;
  std::vector<const Cell*> supporters;  ///< Cells whose closures say so.
  [[nodiscard]] int net() const { return gained - lost; }
};

/// What speaks for and against a charged stretch.
struct Evidence {
  std::set<std::size_t> against;  ///< Positions of the closures that would be gained.
  PlacePairs places_against;
  PlacePairs places_for;
  [[nodiscard]] bool acquits(double max_share) const { return places_for.count() > max_share * places_against.count(); }
};

/// Says which stretches of odometry may have failed, what they would have missed and what speaks for that, as the cells
/// stand. It never changes them: that is the trial's.
class Prosecution {
 public:
  /// All must outlive this.
  Prosecution(std::span<const OdometryChain> chains, const ConsistencyCells& cells, const OdometryTrialConfig& config)
      : chains_(chains), cells_(cells), config_(config) {}

  /// Every stretch between neighbouring ends of closures on a piece that would make enough more of them agree. Rival
  /// cliques too small to convict do not count as ends.
  [[nodiscard]] std::vector<Charge> charges(std::size_t chain, std::size_t piece) const;
  /// What the odometry would have missed, as the cell says that gains most; the cells that say the same are its
  /// supporters. Its size is the least over where in the stretch it happened, and the stretch is narrowed to there.
  void measure_jump(Charge& charge) const;
  /// For a stretch speak the closures that would be lost, and those over it that fit its odometry but would not, had it
  /// failed as charged. `charge` must be measured.
  [[nodiscard]] Evidence evidence(const Charge& charge) const;

 private:
  struct Divided;
  /// The cells that the cut would divide.
  [[nodiscard]] std::vector<Divided> divided(std::size_t chain, const Cut& cut) const;
  [[nodiscard]] bool would_notice(const PlacedClosure& closure, const Charge& charge) const;
  /// T_a_b by odometry.
  [[nodiscard]] Pose3 odometry(std::size_t chain, std::size_t a, std::size_t b) const;
  /// T_from_to over a stretch as the closures of one cell see it, by those with the shortest odometry between them;
  /// nothing when the cell gains nothing by cutting it.
  [[nodiscard]] std::optional<Pose3> seen_around(const Charge& charge, const Divided& d) const;

  std::span<const OdometryChain> chains_;
  const ConsistencyCells& cells_;
  const OdometryTrialConfig& config_;
};

}  // namespace tutti::estimation::internal
