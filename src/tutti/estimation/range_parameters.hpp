// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "tutti/estimation/range_factor.hpp"

namespace tutti::estimation {

/// A range between two nodes of a graph.
struct GraphRange {
  std::size_t from = 0, to = 0;
  Range range;
  double sigma_m = 0.0;
};

/// A number on which ranges depend that a graph does not have, such as how far a clock is off: the positions of these
/// ranges, and by how much each is longer for a unit of it.
using RangeParameter = std::vector<std::pair<std::size_t, double>>;

struct ParameterEstimate {
  double value = 0.0, sigma = 0.0;
};

/// Estimates such numbers as if the graph had them, all together, to first order. `graph` is at its optimum and has the
/// ranges as its last edges; `weights` are the edges' factors on their information. This is Rao's score test ("Large
/// sample tests of statistical hypotheses concerning several parameters", 1948): with e the residuals of the ranges, W
/// their information, X the parameters' columns, B = J^T W X and H the Hessian of all edges,
///   value = -(X^T W X - B^T H^-1 B)^-1 X^T W e,
/// whose inverse is their covariance. One factorisation serves all, and each takes one more solution. A number of which
/// nothing is known has a large sigma. Empty for a graph that does not determine its poses.
std::vector<ParameterEstimate> missing_parameters(const PoseGraph& graph, std::span<const double> weights,
                                                  std::span<const GraphRange> ranges,
                                                  std::span<const RangeParameter> parameters);

}  // namespace tutti::estimation
