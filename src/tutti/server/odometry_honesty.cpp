// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/odometry_honesty.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace tutti::server {
namespace {

constexpr double kMedianChiSquare6 = 5.348;
constexpr double kLeast = 0.04;
constexpr std::size_t kEnough = 8;

/// Odometry's covariance up to each of a robot's nodes, in the frame of the first; pieces without odometry between them
/// are told apart.
struct Chain {
  struct Node {
    Pose3 T_first_body;
    Matrix6d covariance;
    std::size_t piece = 0;
  };
  std::map<std::uint32_t, Node> nodes;  // by KeyframeId::index
  Pose3 T_first_odom;
};

std::map<RobotId, Chain> odometry_chains(const MapEstimate& map) {
  std::vector<const PoseGraphEdge*> edge_to(map.nodes.size(), nullptr);  // the odometry that ends at a node
  for (std::size_t e = 0; e < map.odometry_edges; ++e) edge_to[map.graph.edges[e].to] = &map.graph.edges[e];
  std::map<RobotId, Chain> chains;
  Chain::Node last{.covariance = Matrix6d::Zero()};
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {  // sorted by robot and index
    const MapNode& node = map.nodes[i];
    const auto [found, is_new] = chains.try_emplace(node.id.robot);
    Chain& chain = found->second;
    if (is_new) {
      chain.T_first_odom = node.T_odom_body.inverse();
      last = {.covariance = Matrix6d::Zero()};
    }
    last.T_first_body = chain.T_first_odom * node.T_odom_body;
    if (edge_to[i] != nullptr) {
      const Matrix6d Ad = adjoint(last.T_first_body);
      last.covariance += Ad * edge_to[i]->information.ldlt().solve(Matrix6d::Identity()) * Ad.transpose();
    } else {
      ++last.piece;
    }
    chain.nodes[node.id.index] = last;
  }
  return chains;
}

/// T_a_b by odometry alone, with covariance (right tangent); nothing across a gap.
std::optional<RelativePose> between(const Chain& chain, std::uint32_t from, std::uint32_t to) {
  const auto a = chain.nodes.find(from);
  const auto b = chain.nodes.find(to);
  if (a == chain.nodes.end() || b == chain.nodes.end() || a->second.piece != b->second.piece) return std::nullopt;
  const Matrix6d to_b = adjoint(b->second.T_first_body.inverse());
  const double sign = from < to ? 1.0 : -1.0;
  return RelativePose{a->second.T_first_body.inverse() * b->second.T_first_body,
                      sign * to_b * (b->second.covariance - a->second.covariance) * to_b.transpose()};
}

/// The loop is about odometry more than about the closure.
bool tells_of(const RelativePose& odometry, const RelativePose& closure) {
  return odometry.covariance.topLeftCorner<3, 3>().trace() > closure.covariance.topLeftCorner<3, 3>().trace();
}

/// Closures between two robots, the end of `robot` first, in its order.
std::vector<LoopClosure> closures_with(const MapEstimate& map, RobotId robot, RobotId other) {
  std::vector<LoopClosure> out;
  for (const JudgedClosure& judged : map.closures) {
    LoopClosure closure = judged.closure;
    if (!judged.accepted) continue;
    if (closure.from.robot == other && closure.to.robot == robot) {
      closure.measurement = inverse(closure.measurement);
      std::swap(closure.from, closure.to);
    }
    if (closure.from.robot == robot && closure.to.robot == other) out.push_back(closure);
  }
  std::ranges::stable_sort(out, {}, [](const LoopClosure& c) { return c.from.index; });
  return out;
}

}  // namespace

std::map<RobotId, double> odometry_variance_factors(const MapEstimate& map) {
  const std::map<RobotId, Chain> chains = odometry_chains(map);
  std::map<RobotId, std::vector<double>> squares;
  for (const JudgedClosure& judged : map.closures) {
    const auto& [from, to, measurement] = judged.closure;
    if (!judged.accepted || from.robot != to.robot) continue;
    const auto odometry = between(chains.at(from.robot), from.index, to.index);
    if (odometry && tells_of(*odometry, measurement))
      squares[from.robot].push_back(squared_distance(measurement, *odometry));
  }
  for (auto one = chains.begin(); one != chains.end(); ++one)
    for (auto two = std::next(one); two != chains.end(); ++two) {
      const std::vector<LoopClosure> closures = closures_with(map, one->first, two->first);
      const std::size_t apart = closures.size() / 2;  // far apart: odometry, not the closures, is to be judged
      for (std::size_t c = apart; c < closures.size(); ++c) {
        const LoopClosure& first = closures[c - apart];
        const auto of_one = between(one->second, first.from.index, closures[c].from.index);
        const auto of_two = between(two->second, first.to.index, closures[c].to.index);
        if (!of_one || !of_two || !tells_of(*of_one, first.measurement)) continue;
        const double square =
            squared_distance(compound(first.measurement, *of_two), compound(*of_one, closures[c].measurement));
        squares[one->first].push_back(square);
        squares[two->first].push_back(square);
      }
    }
  std::map<RobotId, double> factors;
  for (const auto& [robot, chain] : chains) {
    std::vector<double>& z = squares[robot];
    factors[robot] = 1.0;
    if (z.size() < kEnough) continue;
    const auto middle = z.begin() + static_cast<std::ptrdiff_t>(z.size() / 2);
    std::nth_element(z.begin(), middle, z.end());
    factors[robot] = std::clamp(*middle / kMedianChiSquare6, kLeast, 1.0);
  }
  return factors;
}

}  // namespace tutti::server
