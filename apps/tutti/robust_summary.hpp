// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "graph_input.hpp"
#include "robust_score.hpp"

/// The summary that `tutti optimise --robust` prints of its result.
namespace tutti::app {

/// The result that the summary is of; the parts outlive it.
struct RobustResult {
  const NamedGraph& graph;
  const server::JudgedGraph& judged;
  const Score& score;
  double time_s = 0.0;  ///< By the clock, of judging alone.
  double cpu_s = 0.0;
  bool is_stopped = false;  ///< By a signal, before all decisions were tried.
};

/// Prints the summary as JSON, or for people.
void print_json(const RobustResult& result);
void print_text(const RobustResult& result);

}  // namespace tutti::app
