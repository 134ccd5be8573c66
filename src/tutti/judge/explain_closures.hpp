// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "tutti/estimation/gnc.hpp"
#include "tutti/judge/odometry_ways.hpp"
#include "tutti/judge/settings.hpp"

namespace tutti::judge {

/// Odometry between two nodes of one piece that is not to be believed.
struct FailedStretch {
  std::size_t from = 0;
  std::size_t to = 0;
  Vector6d missed = Vector6d::Zero();  ///< local(odometry, what the closures say), where the stretch was let go.
};

/// What a search took.
struct SearchWork {
  std::size_t hypotheses = 0;      ///< Tried.
  std::size_t factorisations = 0;  ///< Of the normal equations, nearly all of them of the graph of the closures' ends.
  SearchWork& operator+=(const SearchWork& other) {
    hypotheses += other.hypotheses;
    factorisations += other.factorisations;
    return *this;
  }
};

struct Judgement {
  std::vector<bool> accepted;         ///< Per closure.
  std::vector<FailedStretch> failed;  ///< By `from`; none overlap.
  bool solved = false;                ///< Otherwise nothing is accepted.
  SearchWork work;
};

/// Decides between closures and odometry that contradict each other (docs/math.md, "Who is wrong?"). A hypothesis says
/// which runs of odometry (between two ends of closures) may be let go and which closures are wrong for certain; its
/// misfit is that of the pose graph solved under it by graduated non-convexity, every closure truncated and the
/// closures at one keyframe sharing one vote, plus what its failed stretches must pay (settings.hpp). The hypothesis
/// with the least misfit counts. Tried are: nothing failed; what fails when all odometry may, less whatever does not
/// pay for itself; and the largest `groups` of closures (positions in `closures`) as wrong all together. `graph`:
/// odometry, then closures. `certain`: per closure, or empty: none; such a closure is right whatever it strains, as
/// somebody knows who stands above this: it is never truncated, nor tried as wrong. Does not depend on the order of the
/// closures, but for rounding.
Judgement explain_closures(const PoseGraph& graph, const OdometryWays& odometry, std::size_t odometry_edges,
                           std::span<const std::vector<std::size_t>> groups, const WhoIsWrongConfig& config,
                           const estimation::GncConfig& gnc, const std::vector<bool>& certain = {});

}  // namespace tutti::judge
