// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/odometry_honesty.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <optional>
#include <vector>

#include "tutti/server/odometry_loops.hpp"

namespace tutti::server {
namespace {

constexpr double kMedianChiSquare6 = 5.348;
constexpr double kLeast = 0.04;
constexpr std::size_t kEnough = 8;

bool is_failed(const MapEstimate& map, const KeyframeId& from, const KeyframeId& to) {
  return std::ranges::any_of(map.failed_odometry, [&](const FailedOdometry& failed) {
    return failed.chain == from.chain && failed.from < to.index && from.index < failed.to;
  });
}

/// Per node the covariance that the map gives the step of odometry that ends there. What failed is a gap: the map's
/// word on it is not odometry's.
std::vector<std::optional<Matrix6d>> steps_of(const MapEstimate& map) {
  std::vector<std::optional<Matrix6d>> out(map.nodes.size());
  for (std::size_t e = 0; e < map.odometry_edges; ++e) {
    const PoseGraphEdge& edge = map.graph.edges[e];
    if (!is_failed(map, map.nodes[edge.from].id, map.nodes[edge.to].id))
      out[edge.to] = edge.information.ldlt().solve(Matrix6d::Identity());
  }
  return out;
}

std::vector<LoopClosure> accepted_closures(const MapEstimate& map) {
  std::vector<LoopClosure> out;
  for (const JudgedClosure& judged : map.closures)
    if (judged.accepted) out.push_back(judged.closure);
  return out;
}

/// The loop is about odometry more than about closures.
bool tells_of_position(const OdometryLoop& loop) {
  return loop.odometry.topLeftCorner<3, 3>().trace() > loop.closures.topLeftCorner<3, 3>().trace();
}

}  // namespace

std::map<ChainId, double> odometry_variance_factors(const MapEstimate& map) {
  const auto chains = odometry_chains(map.nodes, steps_of(map));
  std::map<ChainId, double> factors;
  for (const auto& [chain, loops] : odometry_loops(chains, accepted_closures(map))) {
    std::vector<double> squares;
    for (const OdometryLoop& loop : loops)
      if (tells_of_position(loop))
        squares.push_back(loop.missed.dot((loop.odometry + loop.closures).ldlt().solve(loop.missed)));
    factors[chain] = 1.0;
    if (squares.size() < kEnough) continue;
    const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
    std::nth_element(squares.begin(), middle, squares.end());
    factors[chain] = std::clamp(*middle / kMedianChiSquare6, kLeast, 1.0);
  }
  return factors;
}

}  // namespace tutti::server
