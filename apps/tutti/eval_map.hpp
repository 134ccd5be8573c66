// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace tutti::app {

struct EvalMapOptions {
  std::string map_path;
  std::string survey_path;
  std::string transform;    ///< "x y z qx qy qz qw" of T_survey_map; empty: identity.
  std::string report_path;  ///< report.json to take T_survey_map from; empty: none.
  double voxel_m = 0.1;
  bool refine = false;
  bool json = false;
};

/// `tutti eval --map`: how far a map's points are from a survey. Returns the exit code.
int eval_map(const EvalMapOptions& options);

/// Seven finite numbers, the last four of norm 1 within 1e-3; otherwise what is wrong, in words for a person.
std::string check_transform(const std::string& text);

}  // namespace tutti::app
