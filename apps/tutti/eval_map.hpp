// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace tutti::app {

/// The options of `tutti eval --map`.
struct EvalMapOptions {
  std::string map_path;
  std::string survey_path;
  std::string transform;    ///< "x y z qx qy qz qw" of T_survey_map; empty: identity.
  std::string report_path;  ///< A report.json that has T_survey_map; empty: none.
  double voxel_m = 0.1;
  bool refine = false;
  bool json = false;
};

/// `tutti eval --map`: prints how far a map's points are from a survey, and returns the exit code.
int eval_map(const EvalMapOptions& options);

/// Checks that the text is seven finite numbers, the last four of norm 1 within 1e-3; returns what is wrong, for
/// people, or an empty text.
std::string check_transform(const std::string& text);

}  // namespace tutti::app
