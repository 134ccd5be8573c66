// SPDX-License-Identifier: BSD-3-Clause
// Maps whose uncertainty is known exactly.
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <vector>

#include "support/consistency/runs.hpp"
#include "tutti/base/random.hpp"
#include "tutti/consistency/chain_uncertainty.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency::test {

inline constexpr std::size_t kSamples = 64;

/// From draws of what the nodes of this chain of the graph may be: draw(poses, rng) -> poses.
template <class Draw>
ChainKnowledge knowledge(const ProxyGraph& graph, const ChainId& chain, Draw draw, std::size_t samples = kSamples) {
  const auto nodes = nodes_of(graph, chain);
  std::vector<Pose3> poses;
  for (const ProxyNode& node : nodes) poses.push_back(node.T_world_body);
  ChainKnowledge out;
  out.samples.resize(static_cast<Eigen::Index>(6 * poses.size()), static_cast<Eigen::Index>(samples));
  for (std::size_t s = 0; s < samples; ++s) {
    const std::vector<Pose3> drawn = draw(poses, Rng(77).fork(s));
    for (std::size_t k = 0; k < poses.size(); ++k)
      out.samples.col(static_cast<Eigen::Index>(s)).segment<6>(static_cast<Eigen::Index>(6 * k)) =
          local(poses[k], drawn[k]);
  }
  return out;
}

/// The errors of server_estimate(): three waves of random phase and white noise, the same along the whole run.
inline ChainUncertainty uncertainty_by(const ServerNoise& noise, const ProxyGraph& graph, const ChainId& chain) {
  return chain_uncertainty(graph, chain, knowledge(graph, chain, [&](const std::vector<Pose3>& poses, Rng rng) {
                             return server_estimate(poses, noise, rng);
                           }));
}

/// Errors of a map made of a random walk and of closures to known places: position and rotation, every axis on its own,
/// with the covariance (A^T A)^-1 of such a walk fixed at every `closure_every`-th node.
class WalkWithClosures {
 public:
  WalkWithClosures(std::size_t nodes, std::size_t closure_every, PoseSigma step, PoseSigma closure)
      : step_(step),
        position_(covariance(nodes, closure_every, step.position_m, closure.position_m)),
        rotation_(covariance(nodes, closure_every, step.rotation_rad, closure.rotation_rad)),
        root_position_(position_.llt().matrixL()),
        root_rotation_(rotation_.llt().matrixL()) {}

  [[nodiscard]] std::size_t nodes() const { return static_cast<std::size_t>(position_.rows()); }
  /// The same for every axis.
  [[nodiscard]] const Eigen::MatrixXd& position_covariance() const { return position_; }
  [[nodiscard]] const Eigen::MatrixXd& rotation_covariance() const { return rotation_; }
  /// Knowledge of the whole run, which is this chain of the graph.
  [[nodiscard]] ChainKnowledge knowledge(const ProxyGraph& graph, const ChainId& chain) const {
    ChainKnowledge out = test::knowledge(
        graph, chain, [this](std::vector<Pose3> poses, Rng rng) { return displace(std::move(poses), rng); });
    const auto nodes = nodes_of(graph, chain);
    const auto spread = ChainUncertainty::spread(nodes.size());
    const auto m = static_cast<Eigen::Index>(spread.size());
    out.spread_covariance.setZero(6 * m, 6 * m);
    for (Eigen::Index a = 0; a < m; ++a)
      for (Eigen::Index b = 0; b < m; ++b) {
        const std::size_t i = spread[static_cast<std::size_t>(a)], k = spread[static_cast<std::size_t>(b)];
        const Eigen::Matrix3d R =
            (nodes[i].T_world_body.rotation.conjugate() * nodes[k].T_world_body.rotation).matrix();
        const auto row = static_cast<Eigen::Index>(i), column = static_cast<Eigen::Index>(k);
        out.spread_covariance.block<3, 3>(6 * a, 6 * b) = position_(row, column) * R;
        out.spread_covariance.block<3, 3>(6 * a + 3, 6 * b + 3) = rotation_(row, column) * R;
      }
    for (std::size_t k = 0; k < spread.size(); ++k) {
      const double steps = k == 0 ? 1.0 : static_cast<double>(spread[k] - spread[k - 1]);
      Matrix6d covariance = Matrix6d::Zero();
      covariance.diagonal().head<3>().setConstant(steps * step_.position_m * step_.position_m);
      covariance.diagonal().tail<3>().setConstant(steps * step_.rotation_rad * step_.rotation_rad);
      out.spread_odometry.push_back(covariance);
    }
    return out;
  }
  [[nodiscard]] ChainUncertainty uncertainty(const ProxyGraph& graph, const ChainId& chain) const {
    return chain_uncertainty(graph, chain, knowledge(graph, chain));
  }
  /// The poses, each off by a draw.
  [[nodiscard]] std::vector<Pose3> displace(std::vector<Pose3> poses, Rng rng) const {
    const Eigen::MatrixXd x = root_position_ * white(rng), r = root_rotation_ * white(rng);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      poses[k] = {so3_exp(r.row(row).transpose()) * poses[k].rotation, poses[k].translation + x.row(row).transpose()};
    }
    return poses;
  }

 private:
  static Eigen::MatrixXd covariance(std::size_t nodes, std::size_t every, double step, double closure) {
    const auto n = static_cast<Eigen::Index>(nodes);
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      if (k % static_cast<Eigen::Index>(every) == 0) information(k, k) += 1.0 / (closure * closure);
      if (k == 0) continue;
      const double w = 1.0 / (step * step);
      information(k, k) += w;
      information(k - 1, k - 1) += w;
      information(k - 1, k) -= w;
      information(k, k - 1) -= w;
    }
    return information.llt().solve(Eigen::MatrixXd::Identity(n, n));
  }
  [[nodiscard]] Eigen::MatrixXd white(Rng& rng) const {
    Eigen::MatrixXd z(position_.rows(), 3);
    for (double& v : z.reshaped()) v = rng.normal();
    return z;
  }
  PoseSigma step_;
  Eigen::MatrixXd position_, rotation_, root_position_, root_rotation_;
};

}  // namespace tutti::consistency::test
