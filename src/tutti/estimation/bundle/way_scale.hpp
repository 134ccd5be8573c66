// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "tutti/estimation/bundle/relative_covariances.hpp"

namespace tutti::bundle {

/// A step between two keyframes of a problem, and what it is compared with.
struct ComparedStep {
  std::size_t from = 0;
  std::size_t to = 0;
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();  ///< Translation of T_from_to by somebody else, m.
  double weight = 1.0;
};

/// By how much a solution makes steps longer than expected: the least-squares factor between the two, long steps first,
/// so that the noise of a robot that stands still is no way.
struct WayScale {
  double scale = 1.0;
  double variance = 0.0;  ///< By the solution's posterior, of `scale`.
  double way_m = 0.0;     ///< Root of the sum of the squared expected lengths; 0: there is no way, and no scale.
};
WayScale way_scale(const std::vector<ComparedStep>& steps, const BundleSolution& solution, const Posterior& posterior);

}  // namespace tutti::bundle
