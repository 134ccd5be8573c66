// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "graph_input.hpp"

namespace tutti::app {

/// The options of `tutti optimise --robust`.
struct RobustOptions {
  GraphSource source;
  std::string output;        ///< OUT.g2o, or OUT.pyfg for a PyFG file; OUT_closures.csv is written beside it.
  std::string trajectories;  ///< Folder for ROBOT.tum; empty: none.
  bool json = false;
};

/// `tutti optimise --robust`: writes its results, and returns the exit code.
int optimise_robust(const RobustOptions& options);

}  // namespace tutti::app
