// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tutti/consistency/explanation.hpp"
#include "tutti/model/trajectory.hpp"

/// For tests of what people are shown: a made-up explanation with plausible shapes.
namespace tutti::mission::test {

/// Nodes are the poses of `trajectory`. Around every origin the disagreement stands out, wider at larger scales;
/// elsewhere it is a third of its threshold.
inline consistency::Explanation example_explanation(const Trajectory& trajectory,
                                                    std::vector<consistency::SuspectedOrigin> origins) {
  constexpr Eigen::Index kScales = 6;
  consistency::Explanation e;
  for (const StampedPose& p : trajectory) {
    e.distance_m.push_back(e.stamps.empty()
                               ? 0.0
                               : e.distance_m.back() +
                                     (p.pose.translation - trajectory[e.stamps.size() - 1].pose.translation).norm());
    e.stamps.push_back(p.stamp);
  }
  for (Eigen::Index s = 0; s < kScales; ++s) e.scale_length_m.push_back(128.0 / std::pow(2.0, s));
  const auto nodes = static_cast<Eigen::Index>(trajectory.size());
  e.significance = Eigen::MatrixXd::Constant(nodes, kScales, 0.33);
  for (Eigen::Index n = 0; n < nodes; ++n)
    for (Eigen::Index s = 0; s < kScales; ++s)
      for (const auto& origin : origins) {
        const Timestamp now = trajectory[static_cast<std::size_t>(n)].stamp;
        const double middle_s = 0.5 * (origin.until - origin.from);
        const double away_s = std::abs(now - origin.from - middle_s);
        const double reach_s = middle_s + 0.5 * e.scale_length_m[static_cast<std::size_t>(s)];
        const double fade = std::pow(0.6, std::abs(static_cast<double>(s) - origin.scale));
        e.significance(n, s) =
            std::max(e.significance(n, s), origin.significance * fade * std::exp(-std::pow(away_s / reach_s, 2)));
      }
  e.position_m = 0.02 * e.significance;
  e.rotation_rad = 0.002 * e.significance;
  e.aligned_rmse_m = 0.71;
  e.expected_rmse_m = 0.02;
  e.origins = std::move(origins);
  return e;
}

}  // namespace tutti::mission::test
