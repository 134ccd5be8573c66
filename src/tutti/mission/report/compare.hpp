// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tutti/mission/compare_trajectories.hpp"

namespace tutti::mission {

/// What `tutti compare` tells; docs/compare.md defines every figure. Times are seconds after B's first node.
struct CompareReport {
  std::string a;  ///< As the user named it; judges.
  std::string b;  ///< Is judged.
  CompareTrajectoriesConfig config;
  std::vector<TrajectoryComparison> robots;
  std::vector<std::string> notes;  ///< Plain words about what was left out.
  std::string version;
};

std::string compare_text(const CompareReport& report);
/// The same bytes for the same input.
std::string compare_json(const CompareReport& report);
/// One page: no script, no fonts, nothing fetched.
std::string compare_html(const CompareReport& report);

/// One row of the disagreement map in figures.
struct ScaleSummary {
  double length_m = 0.0;      ///< Explanation::scale_length_m
  double significance = 0.0;  ///< The largest at one node, over its threshold; at `worst`.
  Timestamp worst;
  double position_m = 0.0;  ///< There.
  double rotation_rad = 0.0;
  std::optional<Timestamp> since;  ///< First node above the threshold.
};
std::vector<ScaleSummary> scale_summaries(const consistency::Explanation& explanation);

}  // namespace tutti::mission
