// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_adjuster.hpp"

namespace tutti::bundle {

struct StereoConfig {
  /// A robot's cameras are contradicted by its odometry when the length of the trajectory that they see differs from
  /// that of the odometry by more than this many standard deviations: their calibration may be wrong.
  double max_sigmas = 3.0;
  std::string contradicted = "one_camera";
  template <class V>
  void describe(V& v) {
    v.field("contradicted", contradicted, one_of({"one_camera", "correct"}),
            "Then its first camera alone is believed, or the baseline is made as long as the odometry asks for.");
  }
};

/// Length of a robot's trajectory as its cameras see it together, over the length by its odometry.
struct StereoScale {
  RobotId robot;
  double ratio = 1.0;
  double sigma = 0.0;       ///< The ratio's: pixels, the odometry's covariance and BundleConfig::odometry_scale_sigma.
  bool is_refused = false;  ///< Contradicted, and only the views of its first camera are left in the problem.
  bool is_corrected = false;  ///< Contradicted, and the baselines in the problem are divided by the ratio.
};

/// Measures the scale of every robot with several cameras, by its own images alone: its odometry contributes how it
/// turned, but not how far it went. Where images and odometry contradict each other, StereoConfig::contradicted
/// determines how `problem` is changed. `odometry`: MergedMap::odometry. Errors are those of BundleAdjuster::adjust();
/// robots whose adjustment fails numerically are left out of the result.
Result<std::vector<StereoScale>> judge_stereo(BundleProblem& problem, const std::vector<RelativePose>& odometry,
                                              const BundleConfig& config, const StereoConfig& stereo);

}  // namespace tutti::bundle
