// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/base/config.hpp"
#include "tutti/base/result.hpp"
#include "tutti/estimation/bundle/bundle_adjuster.hpp"

namespace tutti::bundle {

struct StereoConfig {
  /// A robot's cameras are contradicted where together they make its way longer or shorter than its odometry by more
  /// than so many standard deviations: their calibration may be wrong.
  double max_sigmas = 3.0;
  std::string contradicted = "one_camera";
  template <class V>
  void describe(V& v) {
    v.field("contradicted", contradicted, one_of({"one_camera", "correct"}),
            "Then its first camera alone is believed, or the baseline is made as long as the odometry asks for.");
  }
};

/// A robot's way by what several cameras see at once, over that by its odometry.
struct StereoScale {
  RobotId robot;
  double ratio = 1.0;
  double sigma = 0.0;       ///< Of the ratio: pixels, the odometry's covariance and BundleConfig::odometry_scale_sigma.
  bool is_refused = false;  ///< Contradicted, and only the first camera is left.
  bool is_corrected = false;  ///< Contradicted, and the baselines are divided by the ratio.
};

/// Measures that of every robot with several cameras, by its own images alone: its odometry says how it turned, and
/// nothing of how far it went. Where the two contradict each other, the views of all but the robot's first camera are
/// dropped from the problem, or its cameras are moved towards the first one. `odometry`: as the robots gave it, in the
/// order of problem.odometry.
Result<std::vector<StereoScale>> judge_stereo(BundleProblem& problem, const std::vector<RelativePose>& odometry,
                                              const BundleConfig& config, const StereoConfig& stereo);

}  // namespace tutti::bundle
