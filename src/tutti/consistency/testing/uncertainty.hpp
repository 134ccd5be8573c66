// SPDX-License-Identifier: BSD-3-Clause
// Maps whose uncertainty is known exactly.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/consistency/testing/runs.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::consistency::test {

/// Standard deviations of every stretch from those by rank and half-length: sag(rank of the middle, L) -> ShapeSigma.
template <class Sag>
ShapeUncertainty stretch_by_stretch(RobotId robot, std::size_t nodes, ShapeSigma whole, Sag sag) {
  ShapeUncertainty out{.chain = robot, .whole = whole};
  for (std::size_t L = ShapeUncertainty::kShortest; 2 * L < nodes; L *= 2) {
    out.sag.emplace_back();
    for (std::size_t i = 0; i < (nodes - 1) / (2 * L); ++i) out.sag.back().push_back(sag(2 * L * i + L, L));
  }
  return out;
}

/// What server_estimate() is off by: three waves of random phase and white noise, the same along the whole run.
inline ShapeUncertainty shape_of(RobotId robot, const ServerNoise& noise, std::size_t nodes) {
  const double A = noise.smooth_m;
  const ShapeSigma whole{std::sqrt(0.5 * A * A * 2.25 + 3.0 * std::pow(noise.local_m, 2)),
                         std::sqrt(3.0) * noise.local_rad};
  return stretch_by_stretch(robot, nodes, whole, [&](std::size_t, std::size_t half) {
    const auto L = static_cast<double>(half);
    double worst = 0.0;
    for (const auto& [amplitude, length] : {std::pair{A, 40.0}, {A, 55.0}, {0.5 * A, 70.0}})
      worst = std::max(worst, 0.5 * std::pow(amplitude * (1.0 - std::cos(L / length)), 2));
    return ShapeSigma{std::sqrt(worst + 1.5 * std::pow(noise.local_m, 2)), std::sqrt(1.5) * noise.local_rad};
  });
}

/// Errors of a map made of a random walk and of closures to known places: position and rotation, every axis on its own,
/// with the covariance (A^T A)^-1 of such a walk held at every `closure_every`-th node.
class WalkWithClosures {
 public:
  WalkWithClosures(std::size_t nodes, std::size_t closure_every, ShapeSigma step, ShapeSigma closure)
      : position_(covariance(nodes, closure_every, step.position_m, closure.position_m)),
        rotation_(covariance(nodes, closure_every, step.rotation_rad, closure.rotation_rad)),
        root_position_(position_.llt().matrixL()),
        root_rotation_(rotation_.llt().matrixL()) {}

  [[nodiscard]] std::size_t nodes() const { return static_cast<std::size_t>(position_.rows()); }
  [[nodiscard]] ShapeUncertainty shape(RobotId robot) const { return shape(robot, nodes()); }
  /// Of the run's first nodes only.
  [[nodiscard]] ShapeUncertainty shape(RobotId robot, std::size_t count) const {
    const auto n = static_cast<Eigen::Index>(count);
    const auto sag = [](const Eigen::MatrixXd& C, std::size_t middle, std::size_t half) {
      const auto m = static_cast<Eigen::Index>(middle), L = static_cast<Eigen::Index>(half);
      const Eigen::Vector3d v(-0.5, 1.0, -0.5);
      Eigen::Matrix3d ends;
      for (Eigen::Index i = 0; i < 3; ++i)
        for (Eigen::Index j = 0; j < 3; ++j) ends(i, j) = C(m + (i - 1) * L, m + (j - 1) * L);
      return std::sqrt(v.dot(ends * v));
    };
    return stretch_by_stretch(robot, count,
                              {whole(position_.topLeftCorner(n, n)), whole(rotation_.topLeftCorner(n, n))},
                              [&](std::size_t m, std::size_t L) {
                                return ShapeSigma{sag(position_, m, L), sag(rotation_, m, L)};
                              });
  }
  /// Of some pairs of the poses, T_a_b in the worst direction: across the arm where the turn at a matters.
  [[nodiscard]] std::vector<ShapeTie> ties(std::span<const Pose3> poses,
                                           const std::vector<std::pair<std::uint32_t, std::uint32_t>>& pairs) const {
    std::vector<ShapeTie> out;
    for (const auto& [a, b] : pairs) {
      const auto difference = [a, b](const Eigen::MatrixXd& C) { return C(a, a) + C(b, b) - 2.0 * C(a, b); };
      const double arm = (poses[b].translation - poses[a].translation).squaredNorm();
      out.push_back(
          {a, b, {std::sqrt(difference(position_) + arm * rotation_(a, a)), std::sqrt(difference(rotation_))}});
    }
    return out;
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
  /// Three axes, less their mean over the run.
  static double whole(const Eigen::MatrixXd& C) {
    return std::sqrt(3.0 * (C.trace() / static_cast<double>(C.rows()) - C.mean()));
  }
  [[nodiscard]] Eigen::MatrixXd white(Rng& rng) const {
    Eigen::MatrixXd z(position_.rows(), 3);
    for (double& v : z.reshaped()) v = rng.normal();
    return z;
  }
  Eigen::MatrixXd position_, rotation_, root_position_, root_rotation_;
};

}  // namespace tutti::consistency::test
