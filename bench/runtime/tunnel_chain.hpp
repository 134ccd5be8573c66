// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <vector>

#include "tutti/base/random.hpp"
#include "tutti/estimation/onboard_smoother.hpp"

/// The paper's tunnel mission in size: 29,152 odometry steps of 4 cm, up and down a winding corridor, and relative
/// poses (1 mm, 1 mrad) between neighbouring constrained nodes and between passes at the same place.
namespace tutti::bench {

inline constexpr std::size_t kTunnelSteps = 29'152;

inline Vector6d noise(Rng& rng, double sigma_m, double sigma_rad) {
  Vector6d xi;
  for (int k = 0; k < 3; ++k) {
    xi[k] = rng.normal(sigma_m);
    xi[3 + k] = rng.normal(sigma_rad);
  }
  return xi;
}

inline Matrix6d covariance(double sigma_m, double sigma_rad) {
  Vector6d d;
  d << Eigen::Vector3d::Constant(sigma_m * sigma_m), Eigen::Vector3d::Constant(sigma_rad * sigma_rad);
  Matrix6d m = d.asDiagonal();
  m(0, 5) = m(5, 0) = 0.3 * sigma_m * sigma_rad;
  return m;
}

struct TunnelChain {
  std::vector<Pose3> truth{Pose3{}};
  std::vector<RelativePose> odometry;
  std::vector<estimation::ChainConstraint> constraints;

  [[nodiscard]] estimation::ChainConstraint measured(Rng& rng, std::size_t a, std::size_t b) const {
    const Pose3 exact = truth[a].inverse() * truth[b];
    return {a, b, {retract(exact, noise(rng, 1e-3, 1e-3)), covariance(1e-3, 1e-3)}};
  }
  [[nodiscard]] estimation::SmootherState state() const { return {truth.front(), odometry, constraints}; }
};

/// `constraints` between `nodes` nodes at equal distances along the chain.
inline TunnelChain tunnel_chain(std::size_t constraints, std::size_t nodes) {
  Rng rng(7);
  TunnelChain m;
  for (std::size_t k = 0; k < kTunnelSteps; ++k) {
    const bool back = k > kTunnelSteps / 2;
    const double bend = (back ? -0.003 : 0.003) * std::sin(0.002 * static_cast<double>(k));
    Vector6d step;
    step << 0.041, 0.0, 0.0, rng.normal(1e-4), rng.normal(1e-4), k == kTunnelSteps / 2 ? std::numbers::pi : bend;
    m.truth.push_back(retract(m.truth.back(), step));
    const Pose3 exact = m.truth[k].inverse() * m.truth[k + 1];
    m.odometry.push_back({retract(exact, noise(rng, 1e-3, 2e-4)), covariance(1e-3, 2e-4)});
  }
  const auto node = [&](std::size_t k) { return k * kTunnelSteps / nodes; };
  for (std::size_t k = 0; k + 1 < nodes && m.constraints.size() < constraints; ++k)
    m.constraints.push_back(m.measured(rng, node(k), node(k + 1)));
  for (std::size_t k = 0; m.constraints.size() < constraints; k = (k + 7) % (nodes / 2 - 2))
    m.constraints.push_back(m.measured(rng, node(k), node(nodes - 1 - k)));
  return m;
}

}  // namespace tutti::bench
