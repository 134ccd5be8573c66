// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/stereo_check.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <map>

#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::visual {
namespace {

/// The epipolar constraint of one point: the angle between the second ray and the plane, and its derivative by turn.
struct Equation {
  double error_rad;
  Eigen::RowVector3d by_turn;
};

double median_error(std::vector<Equation> equations) {
  const auto middle = equations.begin() + static_cast<std::ptrdiff_t>(equations.size() / 2);
  std::ranges::nth_element(equations, middle, {}, [](const Equation& it) { return std::abs(it.error_rad); });
  return std::abs(middle->error_rad);
}

}  // namespace

void StereoCheck::add(const TrackedImage& first, const TrackedImage& second) {
  std::map<std::uint64_t, Eigen::Vector3d> seen;
  for (const TrackedKeypoint& it : first.keypoints)
    if (const auto ray = unproject(first_.model, it.pixel.cast<double>()); ray && it.track != 0)
      seen.emplace(it.track, *ray);
  for (const TrackedKeypoint& it : second.keypoints)
    if (const auto at = seen.find(it.track); at != seen.end())
      if (const auto ray = unproject(second_.model, it.pixel.cast<double>())) rays_.emplace_back(at->second, *ray);
}

std::optional<StereoTurn> StereoCheck::turn() const {
  constexpr int kIterations = 20;
  constexpr double kMadOfSigma = 0.6745, kLossMedians = 3.0;
  const Pose3 T_first_second = first_.T_body_camera.inverse() * second_.T_body_camera;
  if (rays_.size() < kFew || !(T_first_second.translation.norm() > 0.0)) return std::nullopt;
  const auto linearise = [&](const Eigen::Vector3d& turn) {
    const Eigen::Matrix3d R = (T_first_second.rotation * so3_exp(turn)).toRotationMatrix();
    std::vector<Equation> out;
    for (const auto& [a, b] : rays_) {
      const Eigen::Vector3d normal = T_first_second.translation.cross(a).normalized();  // zero for the epipole
      const Eigen::RowVector3d in_second = normal.transpose() * R;
      out.push_back({in_second.dot(b), -in_second * skew(b)});
    }
    return out;
  };
  StereoTurn out;
  Eigen::Matrix3d H;
  auto equations = linearise(out.turn_rad);
  out.stated_px = median_error(equations) * second_.model.fx;
  for (int i = 0; i < kIterations; ++i) {
    // Cauchy's loss, its scale by the residuals themselves: what is off by a turn is no outlier, wrong matches are.
    const double scale_rad = kLossMedians * std::max(median_error(equations), 1e-6);
    H.setZero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const Equation& it : equations) {
      const double weight = 1.0 / (1.0 + std::pow(it.error_rad / scale_rad, 2));
      H += weight * it.by_turn.transpose() * it.by_turn;
      g += weight * it.error_rad * it.by_turn.transpose();
    }
    const Eigen::Vector3d step = -(H + 1e-9 * Eigen::Matrix3d::Identity()).ldlt().solve(g);
    if (!step.allFinite()) return std::nullopt;
    out.turn_rad += step;
    equations = linearise(out.turn_rad);
    if (step.norm() < 1e-7) break;
  }
  out.turned_px = median_error(equations) * second_.model.fx;
  const double sigma_rad = median_error(equations) / kMadOfSigma;
  out.covariance = sigma_rad * sigma_rad * (H + 1e-9 * Eigen::Matrix3d::Identity()).inverse() +
                   kStated_rad * kStated_rad * Eigen::Matrix3d::Identity();
  out.is_wrong = squared_distance(out.turn_rad, out.covariance) > kMaxSigmas * kMaxSigmas || out.turned_px > kMax_px;
  out.is_turned = out.is_wrong && 2.0 * out.turned_px < out.stated_px;
  return out;
}

}  // namespace tutti::visual
