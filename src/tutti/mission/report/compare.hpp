// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tutti/mission/compare_trajectories.hpp"

namespace tutti::mission {

/// The report of `tutti compare`; docs/compare.md defines every figure. Times are seconds after B's first node.
struct CompareReport {
  std::string a;  ///< The judge, as the user named it.
  std::string b;  ///< The side that is judged.
  CompareTrajectoriesConfig config;
  std::vector<TrajectoryComparison> robots;
  std::vector<std::string> notes;  ///< Say in plain words what was left out.
  std::string version;
};

std::string compare_text(const CompareReport& report);
/// A function of its input, byte for byte.
std::string compare_json(const CompareReport& report);
/// One page, which opens without a network. A function of its input, too.
std::string compare_html(const CompareReport& report);

/// One scale of the disagreement map in figures.
struct ScaleSummary {
  double length_m = 0.0;      ///< Explanation::scale_length_m
  double significance = 0.0;  ///< The largest of any node, over its threshold; found at `worst`.
  Timestamp worst;
  double position_m = 0.0;  ///< At `worst`.
  double rotation_rad = 0.0;
  std::optional<Timestamp> since;  ///< The first node above the threshold.
};
/// One summary per scale, the largest first.
std::vector<ScaleSummary> scale_summaries(const consistency::Explanation& explanation);

}  // namespace tutti::mission
