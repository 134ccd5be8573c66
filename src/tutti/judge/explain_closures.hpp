// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/gnc.hpp"
#include "tutti/judge/odometry_trajectories.hpp"
#include "tutti/judge/settings.hpp"

namespace tutti::judge {

/// A segment of odometry, between two nodes of one segment (OdometryTrajectories), that failed.
struct FailedSegment {
  std::size_t from = 0;
  std::size_t to = 0;
  Vector6d missed = Vector6d::Zero();  ///< local(T_from_to by odometry, T_from_to by the closures), right tangent, of
                                       ///< the segment that was disregarded.
};

/// The cost of a search.
struct SearchWork {
  std::size_t hypotheses = 0;  ///< Hypotheses tried.
  /// How often normal equations were factorised, nearly always those of the graph of the closures' ends.
  std::size_t factorisations = 0;
  SearchWork& operator+=(const SearchWork& other) {
    hypotheses += other.hypotheses;
    factorisations += other.factorisations;
    return *this;
  }
};

/// The result of explain_closures().
struct Judgement {
  std::vector<bool> accepted;         ///< Per closure.
  std::vector<FailedSegment> failed;  ///< Sorted by `from`; none overlap.
  bool solved = false;                ///< False: the graph could not be solved, and nothing is accepted.
  SearchWork work;
};

/// Decides between closures and odometry that contradict each other (docs/math.md, "Outlier rejection"). A hypothesis
/// says which segments of odometry between two neighbouring ends of closures (runs) may be disregarded, and which
/// closures are wrong for certain. Its misfit is that of the pose graph solved under it by graduated non-convexity,
/// with every closure truncated and the closures at one keyframe sharing one vote, plus the price of its failed
/// segments. The hypothesis with the least misfit is taken. Tried are: nothing failed; what fails when all odometry may
/// fail, less whatever does not pay for itself; that it failed where it stood still; and the largest `groups` of
/// closures as wrong all together. `graph`: its first `odometry_edges` edges are odometry, all others closures, and
/// `groups` are positions among these. `certain`: per closure whether an operator vouches for it (empty: none); such a
/// closure is never truncated and never tried as wrong. The result does not depend on the order of the closures, but
/// for rounding.
Judgement explain_closures(PoseGraph graph, const OdometryTrajectories& odometry, std::size_t odometry_edges,
                           std::span<const std::vector<std::size_t>> groups, const OutlierRejectionConfig& config,
                           const estimation::GncConfig& gnc, const std::vector<bool>& certain = {});

}  // namespace tutti::judge
