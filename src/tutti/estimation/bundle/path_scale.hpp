// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "tutti/estimation/bundle/relative_covariances.hpp"

namespace tutti::bundle {

/// A step between two keyframes of a problem, with the translation that another source expects of it.
struct ComparedStep {
  std::size_t from = 0;
  std::size_t to = 0;
  Eigen::Vector3d expected = Eigen::Vector3d::Zero();  ///< Translation of T_from_to by the other source, m.
  double weight = 1.0;
};

/// How much longer a solution makes steps than expected: the factor of the least-squares fit of the solution's
/// translations to the expected ones, in which long steps count most, so that the noise of a robot that stands still
/// does not count as distance.
struct PathScale {
  double scale = 1.0;
  double variance = 0.0;  ///< That of `scale`, by the posterior.
  double length_m = 0.0;  ///< Root of the weighted sum of squared expected lengths; 0 means that there is no distance
                          ///< and `scale` has no meaning.
};
PathScale path_scale(const std::vector<ComparedStep>& steps, const BundleSolution& solution,
                     const Posterior& posterior);

}  // namespace tutti::bundle
