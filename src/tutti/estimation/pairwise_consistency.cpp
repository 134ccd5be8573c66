// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/estimation/pairwise_consistency.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "tutti/base/check.hpp"
#include "tutti/estimation/chi_square.hpp"
#include "tutti/estimation/internal/maximum_clique.hpp"

namespace tutti::estimation {
namespace {

/// Odometry of one robot in a frame at the middle of its trajectory (short levers keep the differences below accurate).
struct Chain {
  std::uint32_t first_index = 0;
  std::vector<Pose3> poses;      ///< T_middle_body
  std::vector<Matrix6d> prefix;  ///< Sum of Ad(T_middle_body_k) Q_k Ad^T over the steps up to each pose.

  explicit Chain(const OdometryChain& odometry) : first_index(odometry.first_index), poses(odometry.T_odom_body) {
    TUTTI_CHECK(!poses.empty() && odometry.step_covariance.size() + 1 == poses.size(), "{} poses, {} covariances",
                poses.size(), odometry.step_covariance.size());
    const Pose3 T_middle_odom = poses[poses.size() / 2].inverse();
    for (Pose3& pose : poses) pose = T_middle_odom * pose;
    prefix.reserve(poses.size());
    prefix.push_back(Matrix6d::Zero());
    for (std::size_t k = 1; k < poses.size(); ++k) {
      const Matrix6d to_middle = adjoint(poses[k]);
      prefix.push_back(prefix.back() + to_middle * odometry.step_covariance[k - 1] * to_middle.transpose());
    }
  }
  [[nodiscard]] bool contains(std::uint32_t index) const {
    return index >= first_index && index - first_index < poses.size();
  }
  /// Covariance of the odometry between two poses, either way round, in the middle frame.
  [[nodiscard]] Matrix6d between(std::size_t a, std::size_t b) const {
    return prefix[std::max(a, b)] - prefix[std::min(a, b)];
  }
};

/// A closure from the first robot (pose i) to the second (pose j), or from an earlier to a later pose of one robot.
struct Candidate {
  std::size_t position = 0;  ///< In the input.
  std::size_t i = 0;
  std::size_t j = 0;
  Pose3 T_first_second;        ///< Between the middle frames, as this closure alone would have it.
  Matrix6d covariance;         ///< Of the closure, in the second's middle frame.
  Matrix6d second_from_first;  ///< Ad(T_first_second^-1)
};

/// The 4-cycle a - odometry of the second from j_a to j_b - b^-1 - odometry of the first from i_b to i_a, seen at j_b,
/// closes within `threshold` of its covariance (Mangelson et al. 2018, eqs. 7 to 9), which is summed in the second's
/// middle frame.
bool agree(const Candidate& a, const Candidate& b, const Chain& first, const Chain& second, double threshold) {
  const Pose3& T_second_jb = second.poses[b.j];
  const Pose3 cycle = T_second_jb.inverse() * (b.T_first_second.inverse() * (a.T_first_second * T_second_jb));
  const Vector6d error = adjoint(T_second_jb) * local(Pose3{}, cycle);
  Matrix6d covariance = a.covariance + b.covariance + second.between(a.j, b.j);
  covariance.noalias() += b.second_from_first * (first.between(a.i, b.i) * b.second_from_first.transpose());
  const Eigen::LLT<Matrix6d> llt(covariance);
  return llt.info() == Eigen::Success && llt.matrixL().solve(error).squaredNorm() <= threshold;
}

bool is_usable(const RelativePose& measurement) {
  return is_valid(measurement.T_a_b, 1e-3) && measurement.covariance.allFinite() &&
         measurement.covariance.llt().info() == Eigen::Success;
}

/// Total order that does not depend on where a closure stands in the input.
bool canonical_less(const LoopClosure& a, const LoopClosure& b) {
  const auto ids = [](const LoopClosure& c) { return std::tie(c.from, c.to); };
  if (ids(a) != ids(b)) return ids(a) < ids(b);
  const auto numbers = [](const LoopClosure& c) {
    Eigen::Matrix<double, 43, 1> v;
    v << c.measurement.T_a_b.translation, c.measurement.T_a_b.rotation.coeffs(),
        Eigen::Map<const Eigen::Matrix<double, 36, 1>>(c.measurement.covariance.data());
    return v;
  };
  const auto x = numbers(a);
  const auto y = numbers(b);
  return std::lexicographical_compare(x.begin(), x.end(), y.begin(), y.end());
}

class Grouping {
 public:
  explicit Grouping(std::span<const OdometryChain> chains) {
    for (const auto& chain : chains) chains_.emplace(chain.robot, Chain(chain));
  }
  [[nodiscard]] const Chain& chain(RobotId robot) const { return chains_.at(robot); }

  /// Nothing when the closure cannot be used.
  [[nodiscard]] std::optional<Candidate> candidate(const LoopClosure& closure) const {
    KeyframeId from = closure.from;
    KeyframeId to = closure.to;
    if (!is_usable(closure.measurement)) return std::nullopt;
    Pose3 T = closure.measurement.T_a_b;
    Matrix6d covariance = closure.measurement.covariance;
    if (to < from) {
      const Matrix6d to_start = adjoint(T);
      covariance = to_start * covariance * to_start.transpose();
      T = T.inverse();
      std::swap(from, to);
    }
    const auto first = chains_.find(from.robot);
    const auto second = chains_.find(to.robot);
    if (first == chains_.end() || second == chains_.end() || from == to || !first->second.contains(from.index) ||
        !second->second.contains(to.index))
      return std::nullopt;
    Candidate out;
    out.i = from.index - first->second.first_index;
    out.j = to.index - second->second.first_index;
    const Pose3& T_second_j = second->second.poses[out.j];
    out.T_first_second = first->second.poses[out.i] * T * T_second_j.inverse();
    const Matrix6d to_middle = adjoint(T_second_j);
    out.covariance = to_middle * covariance * to_middle.transpose();
    out.second_from_first = adjoint(out.T_first_second.inverse());
    return out;
  }

 private:
  std::map<RobotId, Chain> chains_;
};

internal::BitGraph agreement_graph(const std::vector<Candidate>& candidates, const Chain& first, const Chain& second,
                                   double threshold) {
  const int n = static_cast<int>(candidates.size());
  internal::BitGraph graph(n);
  for (int b = 1; b < n; ++b)
    for (int a = 0; a < b; ++a)
      if (agree(candidates[a], candidates[b], first, second, threshold)) graph.connect(a, b);
  return graph;
}

}  // namespace

PairwiseConsistencyResult pairwise_consistency(std::span<const OdometryChain> chains,
                                               std::span<const LoopClosure> closures,
                                               const PairwiseConsistencyConfig& config) {
  const Grouping grouping(chains);
  std::vector<std::size_t> order(closures.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return canonical_less(closures[a], closures[b]); });
  std::map<std::pair<RobotId, RobotId>, std::vector<Candidate>> groups;
  for (const std::size_t position : order) {
    auto candidate = grouping.candidate(closures[position]);
    if (!candidate) continue;
    candidate->position = position;
    groups[std::minmax(closures[position].from.robot, closures[position].to.robot)].push_back(*candidate);
  }

  PairwiseConsistencyResult out{.accepted = std::vector<bool>(closures.size(), false), .groups = {}};
  const double threshold = chi_square_6_quantile(config.confidence);
  for (const auto& [robots, candidates] : groups) {
    ConsistencyGroup group{.first = robots.first, .second = robots.second, .closures = {}, .accepted = {}};
    const auto graph =
        agreement_graph(candidates, grouping.chain(robots.first), grouping.chain(robots.second), threshold);
    const auto clique = internal::maximum_clique(graph, config.max_search_steps);
    for (const auto& candidate : candidates) group.closures.push_back(candidate.position);
    for (const int vertex : clique.vertices) {
      group.accepted.push_back(candidates[vertex].position);
      out.accepted[candidates[vertex].position] = true;
    }
    group.is_maximum = clique.is_maximum;
    out.groups.push_back(std::move(group));
  }
  return out;
}

}  // namespace tutti::estimation
