// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "graph_input.hpp"
#include "tutti/evaluation/ate.hpp"

/// How good the result of `tutti optimise --robust` is, where the truth or the closures' labels are known.
namespace tutti::app {

/// A map against the truth: RMSE of positions after one alignment of all robots of its largest component, and of each
/// robot by itself.
struct MapErrors {
  std::optional<evaluation::AteResult> joint;  ///< Nothing without a truth.
  std::size_t robots_in_joint = 0;
  std::vector<std::optional<evaluation::AteResult>> robots;
};

/// The map's errors, and how many closures were classified right.
struct Score {
  MapErrors map;
  /// The errors of the least squares of the odometry as stated and the right closures alone, begun from the
  /// measurements: what a judge would reach who knows which closures are wrong. Nothing where that is not known, or
  /// where these edges do not determine every pose.
  std::optional<MapErrors> perfect;
  std::size_t right = 0, accepted = 0, right_accepted = 0;
  bool has_labels = false;

  [[nodiscard]] double precision() const { return share(right_accepted, accepted); }
  [[nodiscard]] double recall() const { return share(right_accepted, right); }

 private:
  static double share(std::size_t of, std::size_t all) {
    return all == 0 ? 1.0 : static_cast<double>(of) / static_cast<double>(all);
  }
};

Score score(const NamedGraph& graph, const server::JudgedGraph& judged, const GraphTruth& truth);

}  // namespace tutti::app
