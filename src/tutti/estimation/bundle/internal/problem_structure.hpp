// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_problem.hpp"

namespace tutti::bundle::internal {

/// The connectivity of a bundle problem.
struct ProblemStructure {
  std::vector<int> component;  ///< Per keyframe.
  int components = 0;
  std::vector<std::size_t> anchors;  ///< Keyframes that keep their poses: constant ones, or a component's first.
  std::vector<bool> has_motion;      ///< Per keyframe: an IMU factor ends here.
  std::vector<bool> begins_motion;   ///< Per keyframe: an IMU factor starts here, and none ends.
  std::vector<bool> has_gravity;     ///< Per component.
};
ProblemStructure analyse(const BundleProblem& problem);

/// Everything finite, covariances positive definite, sigmas positive: else what is not, by name.
Status check_problem(const BundleProblem& problem);

/// Velocities, biases and gravity to start from: of the poses' differences, the linearisations, and both.
void initialise_motion(const BundleProblem& problem, const ProblemStructure& structure, BundleSolution& solution);

}  // namespace tutti::bundle::internal
