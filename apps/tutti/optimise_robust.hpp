// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "graph_input.hpp"

namespace tutti::app {

struct RobustOptions {
  GraphSource source;
  std::string output;        ///< OUT.g2o, or OUT.pyfg of a PyFG file; OUT_closures.csv beside it.
  std::string trajectories;  ///< Folder for ROBOT.tum; empty: none.
  bool json = false;
};

/// `tutti optimise --robust`: returns the exit code.
int optimise_robust(const RobustOptions& options);

}  // namespace tutti::app
