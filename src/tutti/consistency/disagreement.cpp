// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/consistency/disagreement.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tutti/base/check.hpp"
#include "tutti/base/chi_square.hpp"
#include "tutti/consistency/internal/chain_filter.hpp"
#include "tutti/consistency/signal.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// The tail fitted to 64 samples is a little light.
constexpr double kFewSamples = 1.05;
constexpr double kCoefficientsShare = 0.5, kDirectionsShare = 0.25;  // the last one twice

/// Rows of the synchronised nodes to rows of all nodes; those between are interpolated, those beyond repeated.
MatrixXd filled(const MatrixXd& synchronised, std::span<const std::size_t> ranks, std::size_t nodes) {
  if (ranks.size() == nodes) return synchronised;
  MatrixXd out(static_cast<Index>(nodes), synchronised.cols());
  std::size_t next = 0;  // the first synchronised node at or after
  for (std::size_t n = 0; n < nodes; ++n) {
    while (next < ranks.size() && ranks[next] < n) ++next;
    const std::size_t after = std::min(next, ranks.size() - 1);
    const std::size_t before = after == 0 || ranks[after] <= n ? after : after - 1;
    const double gap = static_cast<double>(ranks[after] - ranks[before]);
    const double alpha = gap > 0.0 ? static_cast<double>(n - ranks[before]) / gap : 0.0;
    out.row(static_cast<Index>(n)) = (1.0 - alpha) * synchronised.row(static_cast<Index>(before)) +
                                     alpha * synchronised.row(static_cast<Index>(after));
  }
  return out;
}

MatrixXd at(const MatrixXd& rows, std::span<const std::size_t> ranks) {
  MatrixXd out(static_cast<Index>(ranks.size()), rows.cols());
  for (std::size_t k = 0; k < ranks.size(); ++k)
    out.row(static_cast<Index>(k)) = rows.row(static_cast<Index>(ranks[k]));
  return out;
}

/// By how much node k is off when the first nodes are laid on each other, [position; rotation] in the axes of `world`.
Vector6d off_by(const Pose3& T_world_first, const Pose3& T_world_k, const Pose3& robot_first, const Pose3& robot_k) {
  const Pose3 T = T_world_first * (robot_first.inverse() * robot_k);
  Vector6d out;
  out << T.translation - T_world_k.translation, so3_log(T.rotation * T_world_k.rotation.conjugate());
  return out;
}

}  // namespace

double Disagreement::largest() const {
  double out = direction_significance;
  if (significance.size() > 0) out = std::max(out, significance.maxCoeff());
  return out;
}

DisagreementConfig DisagreementConfig::for_run_of(std::size_t nodes) const {
  const double doublings = std::floor(std::log2(std::max(1.0, static_cast<double>(nodes) / 2.0)));
  DisagreementConfig out = *this;
  out.false_alarm_rate /= (doublings + 1.0) * (doublings + 2.0);
  return out;
}

DisagreementTest::DisagreementTest(const ProxyGraph& graph, const ChainId& chain, std::span<const NodePair> pairs,
                                   const DisagreementConfig& config)
    : uncertainty_(uncertainty_of(graph, chain)), config_(config) {
  TUTTI_CHECK(pairs.size() >= 2, "{} pairs", pairs.size());
  const std::span<const ProxyNode> nodes = nodes_of(graph, chain);
  const auto first = static_cast<std::size_t>(nodes.data() - graph.nodes.data());
  for (const ProxyNode& node : nodes) server_.push_back(node.T_world_body);
  for (const NodePair& pair : pairs) ranks_.push_back(pair.proxy - first);
  if (uncertainty_ == nullptr) return;
  if (uncertainty_->scales.size() >= 2) {
    laplacian_ = internal::chain_laplacian(graph, chain);
    filter_ = std::make_unique<spectral::WaveletFilter>(laplacian_, static_cast<int>(uncertainty_->scales.size()));
  }
  sigma_m_ = Eigen::VectorXd::Zero(static_cast<Index>(ranks_.size()));
  for (const ScaleUncertainty& scale : uncertainty_->scales)
    for (std::size_t k = 0; k < ranks_.size() && !scale.sigma.empty(); ++k)
      sigma_m_(static_cast<Index>(k)) += std::pow(scale.sigma[ranks_[k] / ChainUncertainty::kBlock].position_m, 2);
  sigma_m_ = sigma_m_.cwiseSqrt();
}

int DisagreementTest::scales() const { return filter_ == nullptr ? 0 : filter_->bank().scales(); }

Disagreement DisagreementTest::operator()(std::span<const Pose3> robot) const {
  TUTTI_CHECK(robot.size() == ranks_.size(), "{} poses, {} synchronised nodes", robot.size(), ranks_.size());
  Disagreement out;
  if (filter_ != nullptr) {
    std::vector<Pose3> server;
    for (const std::size_t rank : ranks_) server.push_back(server_[rank]);
    measure_scales((*filter_)(filled(pose_difference(server, robot), ranks_, server_.size())), out);
  }
  if (uncertainty_ != nullptr && config_.without != "directions")
    out.direction_significance = measure_directions(robot);
  return out;
}

void DisagreementTest::measure_scales(const MatrixXd& W, Disagreement& out) const {
  const auto tested = static_cast<double>(
      std::ranges::count_if(uncertainty_->scales, [](const ScaleUncertainty& scale) { return !scale.sigma.empty(); }));
  const auto n = static_cast<Index>(server_.size());
  const double tests = 2.0 * std::max(1.0, tested);
  const double local =
      kFewSamples * std::sqrt(chi_square_exceeded_with(
                        config_.false_alarm_rate * kCoefficientsShare / (tests * static_cast<double>(n)), 3.0));
  MatrixXd metres(n, scales()), radians(n, scales()), significance = MatrixXd::Zero(n, scales());
  for (int s = 0; s < scales(); ++s) {
    metres.col(s) = W.middleCols<3>(6 * s).rowwise().norm();
    radians.col(s) = W.middleCols<3>(6 * s + 3).rowwise().norm();
    const ScaleUncertainty& scale = uncertainty_->scales[static_cast<std::size_t>(s)];
    if (scale.sigma.empty() || config_.without == "coefficients") continue;
    for (Index k = 0; k < n; ++k) {
      const PoseSigma& sigma = scale.sigma[static_cast<std::size_t>(k) / ChainUncertainty::kBlock];
      significance(k, s) = std::max(metres(k, s) / sigma.position_m, radians(k, s) / sigma.rotation_rad) / local;
    }
  }
  out.position_m = at(metres, ranks_);
  out.rotation_rad = at(radians, ranks_);
  out.significance = at(significance, ranks_);
}

double DisagreementTest::measure_directions(std::span<const Pose3> robot) const {
  const auto& directions = uncertainty_->directions;
  if (directions.empty()) return 0.0;
  std::vector<Vector6d> off;
  Pose3 robot_first;
  const std::vector<std::size_t> spread = ChainUncertainty::spread(server_.size());
  for (const std::size_t node : spread) {
    const auto found = std::ranges::lower_bound(ranks_, node);
    if (found == ranks_.end() || *found != node) return 0.0;  // the robot does not have them all
    const Pose3& T = robot[static_cast<std::size_t>(found - ranks_.begin())];
    if (node == spread.front())
      robot_first = T;
    else
      off.push_back(off_by(server_[spread.front()], server_[node], robot_first, T));
  }
  double squares = 0.0, largest = 0.0;
  for (const KnownDirection& direction : directions) {
    double sum = 0.0;
    for (std::size_t i = 0; i < direction.position.size(); ++i) {
      const auto axis = static_cast<Index>(i % 3);
      sum += direction.position[i] / 127.0 * off[i / 3](axis) +
             direction.rotation_scale * direction.rotation[i] / 127.0 * off[i / 3](3 + axis);
    }
    const double square = std::pow(sum / direction.sigma, 2);
    squares += square;
    largest = std::max(largest, square);
  }
  const auto count = static_cast<double>(directions.size());
  const double rate = config_.false_alarm_rate * kDirectionsShare;
  return std::sqrt(
      std::max(squares / chi_square_exceeded_with(rate, count), largest / chi_square_exceeded_with(rate / count, 1.0)));
}

double DisagreementTest::scale_length_m(int scale) const {
  double length_m = 0.0;
  for (std::size_t k = 1; k < server_.size(); ++k)
    length_m += (server_[k].translation - server_[k - 1].translation).norm();
  if (scale == 0 || filter_ == nullptr) return length_m;
  // White noise has the mean degree as its frequency; the largest one is of the densest place only.
  const auto nodes = static_cast<double>(server_.size());
  const double wanted = std::ldexp(laplacian_.diagonal().sum() / nodes, scale - scales() + 1);
  // A wave of half the length L, in no particular direction, has the frequency sum w (1 - cos(pi d / L)) / nodes over
  // all edges, every one of them twice in the matrix. Half of L doubles the angles, 1 - cos 2x = 2 v (2 - v) with
  // v = 1 - cos x: two lengths take turns.
  std::vector<double> weights, distances_m;
  for (int a = 0; a < laplacian_.outerSize(); ++a)
    for (spectral::SparseMatrix::InnerIterator entry(laplacian_, a); entry && entry.row() < a; ++entry) {
      const auto& from = server_[static_cast<std::size_t>(a)].translation;
      const auto& to = server_[static_cast<std::size_t>(entry.row())].translation;
      weights.push_back(-2.0 * entry.value());
      distances_m.push_back((to - from).norm());
    }
  const auto weight = Eigen::ArrayXd::Map(weights.data(), static_cast<Index>(weights.size()));
  const auto distance_m = Eigen::ArrayXd::Map(distances_m.data(), static_cast<Index>(distances_m.size()));
  const auto raised = [&](double half_wave_m) -> Eigen::ArrayXd {
    return 2.0 * (0.5 * std::numbers::pi / half_wave_m * distance_m).sin().square();
  };
  Eigen::ArrayXd now = raised(length_m), next = raised(length_m / std::numbers::sqrt2);
  const double shortest_m = 2.0 * length_m / nodes;
  while (length_m > shortest_m && (weight * now).sum() / nodes < wanted) {
    length_m /= std::numbers::sqrt2;
    now = 2.0 * now * (2.0 - now);
    now.swap(next);
  }
  return std::max(length_m, shortest_m);
}

std::vector<Pose3> odometry_at(std::span<const RobotNode> nodes, std::span<const NodePair> pairs) {
  std::vector<Pose3> out;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    out.push_back(k == 0 ? Pose3{} : out.back());
    for (std::size_t n = k == 0 ? pairs[k].robot : pairs[k - 1].robot; n < pairs[k].robot; ++n)
      out.back() = out.back() * nodes[n + 1].odometry.T_a_b;
  }
  return out;
}

}  // namespace tutti::consistency
