// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/visual/absolute_pose.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "tutti/geometry/so3.hpp"
#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/visual/p3p.hpp"

namespace tutti::visual {
namespace {

constexpr std::size_t kLeastInliers = 4;
constexpr int kRounds = 5;        // of refining and finding the inliers again
constexpr int kRefinements = 10;  // of Gauss-Newton
constexpr double kLossSigmas2 = 4.0;
constexpr double kConverged = 1e-9;  // m and rad

/// Sightings that have a direction, by camera, with these directions.
struct Prepared {
  std::vector<std::uint32_t> index;
  std::vector<Eigen::Vector3d> direction;
};
std::vector<Prepared> prepare(std::span<const Sighting> sightings, const std::vector<Camera>& cameras) {
  std::vector<Prepared> out(cameras.size());
  for (std::uint32_t i = 0; i < sightings.size(); ++i) {
    const auto direction = unproject(cameras[sightings[i].camera].model, sightings[i].pixel);
    if (!direction) continue;
    out[sightings[i].camera].index.push_back(i);
    out[sightings[i].camera].direction.push_back(*direction);
  }
  return out;
}

class Problem {
 public:
  Problem(std::span<const Sighting> sightings, const std::vector<Camera>& cameras)
      : sightings_(sightings), cameras_(cameras) {
    for (const Camera& camera : cameras) T_camera_body_.push_back(camera.T_body_camera.inverse());
  }

  /// px^2; nothing when the camera cannot see the point.
  [[nodiscard]] std::optional<double> squared_error(const Sighting& s, const Pose3& T_body_map) const {
    const auto pixel = project(cameras_[s.camera].model, T_camera_body_[s.camera] * (T_body_map * s.point));
    if (!pixel) return std::nullopt;
    return (*pixel - s.pixel).squaredNorm();
  }

  /// Sum of squared errors, each at most `most`; larger than `enough` as soon as it cannot be less.
  [[nodiscard]] double score(const Pose3& T_map_body, double most, double enough) const {
    const Pose3 T_body_map = T_map_body.inverse();
    double sum = 0.0;
    for (const Sighting& s : sightings_) {
      sum += std::min(most, squared_error(s, T_body_map).value_or(most));
      if (sum > enough) break;
    }
    return sum;
  }

  [[nodiscard]] std::vector<std::uint32_t> inliers(const Pose3& T_map_body, double most) const {
    const Pose3 T_body_map = T_map_body.inverse();
    std::vector<std::uint32_t> out;
    for (std::uint32_t i = 0; i < sightings_.size(); ++i)
      if (squared_error(sightings_[i], T_body_map).value_or(most + 1.0) <= most) out.push_back(i);
    return out;
  }

  struct Normal {
    Matrix6d H = Matrix6d::Zero();
    Vector6d g = Vector6d::Zero();
    double chi2 = 0.0;
  };
  /// Residuals weighed by the inverse covariance of the pixel and of the point as the camera sees it.
  [[nodiscard]] Normal normal_equations(const std::vector<std::uint32_t>& chosen, const Pose3& T_map_body,
                                        bool robust) const {
    const Pose3 T_body_map = T_map_body.inverse();
    Normal out;
    for (const std::uint32_t i : chosen) {
      const Sighting& s = sightings_[i];
      const Pose3& T_camera_body = T_camera_body_[s.camera];
      const Eigen::Vector3d p_body = T_body_map * s.point;
      Eigen::Matrix<double, 2, 3> d_pixel_d_camera;
      const auto pixel = project(cameras_[s.camera].model, T_camera_body * p_body, &d_pixel_d_camera);
      if (!pixel) continue;
      const Eigen::Matrix<double, 2, 3> d_body = d_pixel_d_camera * T_camera_body.rotation.toRotationMatrix();
      const Eigen::Matrix<double, 2, 3> d_map = d_body * T_body_map.rotation.toRotationMatrix();
      const Eigen::Matrix2d covariance =
          s.sigma_px * s.sigma_px * Eigen::Matrix2d::Identity() + d_map * s.covariance_m2 * d_map.transpose();
      Eigen::Matrix<double, 2, 6> J;  // (T Exp(xi))^-1 p = p_body - rho - theta x p_body
      J << -d_body, d_body * skew(p_body);
      const Eigen::Vector2d r = *pixel - s.pixel;
      Eigen::Matrix2d information = covariance.inverse();
      const double chi2 = r.dot(information * r);
      if (robust) information /= 1.0 + chi2 / kLossSigmas2;
      out.H += J.transpose() * information * J;
      out.g += J.transpose() * information * r;
      out.chi2 += chi2;
    }
    return out;
  }

 private:
  std::span<const Sighting> sightings_;
  const std::vector<Camera>& cameras_;
  std::vector<Pose3> T_camera_body_;
};

Pose3 refine(const Problem& problem, const std::vector<std::uint32_t>& chosen, Pose3 T_map_body) {
  for (int i = 0; i < kRefinements; ++i) {
    const auto normal = problem.normal_equations(chosen, T_map_body, true);
    const Vector6d step = -solve_definite(normal.H, normal.g);
    if (!step.allFinite()) break;
    T_map_body = retract(T_map_body, step);
    if (step.norm() < kConverged) break;
  }
  return T_map_body;
}

/// Three different sightings of one camera, which is drawn by how many it has.
struct Sample {
  std::size_t camera = 0;
  std::array<std::size_t, 3> which{};  ///< Indices of the camera's sightings.
};
std::optional<Sample> draw(const std::vector<Prepared>& prepared, Rng& rng) {
  std::size_t total = 0;
  for (const Prepared& p : prepared) total += p.index.size() >= 3 ? p.index.size() : 0;
  if (total == 0) return std::nullopt;
  std::size_t first = rng.index(total);
  Sample out;
  while (prepared[out.camera].index.size() < 3 || first >= prepared[out.camera].index.size()) {
    if (prepared[out.camera].index.size() >= 3) first -= prepared[out.camera].index.size();
    ++out.camera;
  }
  const std::size_t n = prepared[out.camera].index.size();
  const std::size_t second = (first + 1 + rng.index(n - 1)) % n;
  std::size_t third = rng.index(n - 2);
  for (const std::size_t taken : {std::min(first, second), std::max(first, second)}) third += third >= taken;
  out.which = {first, second, third};
  return out;
}

/// Samples after which one without outliers was drawn with this confidence.
double samples_needed(double inlier_share, double confidence) {
  const double all_inliers = std::pow(inlier_share, 3);
  if (all_inliers >= 1.0) return 1.0;
  if (all_inliers <= 0.0) return 1e18;
  return std::log(std::max(1e-12, 1.0 - confidence)) / std::log1p(-all_inliers);
}

std::optional<Pose3> ransac(std::span<const Sighting> sightings, const std::vector<Camera>& cameras,
                            const Problem& problem, const AbsolutePoseConfig& config, Rng& rng,
                            std::size_t least_inliers, std::size_t* samples) {
  const auto prepared = prepare(sightings, cameras);
  const double most = config.max_reprojection_px * config.max_reprojection_px;
  std::optional<Pose3> best;
  double best_score = most * static_cast<double>(sightings.size());
  const auto needed_for = [&](std::size_t inliers) {
    const double share = std::min(1.0, static_cast<double>(inliers) / static_cast<double>(sightings.size()));
    return std::min<double>(config.max_samples, samples_needed(share, config.confidence));
  };
  double needed = needed_for(std::max(least_inliers, kLeastInliers));
  for (int i = 0; i < needed; ++i) {
    const auto sample = draw(prepared, rng);
    if (!sample) return std::nullopt;
    if (samples != nullptr) ++*samples;
    const Prepared& its = prepared[sample->camera];
    std::array<Eigen::Vector3d, 3> directions, points;
    for (std::size_t k = 0; k < 3; ++k) {
      directions[k] = its.direction[sample->which[k]];
      points[k] = sightings[its.index[sample->which[k]]].point;
    }
    const Pose3 T_camera_body = cameras[sample->camera].T_body_camera.inverse();
    for (const Pose3& T_camera_map : p3p(directions, points)) {
      const Pose3 T_map_body = T_camera_map.inverse() * T_camera_body;
      const double score = problem.score(T_map_body, most, best_score);
      if (score >= best_score) continue;
      best_score = score;
      best = T_map_body;
      needed = std::min(needed, needed_for(problem.inliers(T_map_body, most).size()));
    }
  }
  return best;
}

}  // namespace

std::optional<AbsolutePose> absolute_pose(std::span<const Sighting> sightings, const std::vector<Camera>& cameras,
                                          const AbsolutePoseConfig& config, Rng rng, std::size_t least_inliers,
                                          std::size_t* samples) {
  if (sightings.size() < kLeastInliers) return std::nullopt;
  const Problem problem(sightings, cameras);
  const auto start = ransac(sightings, cameras, problem, config, rng, least_inliers, samples);
  if (!start) return std::nullopt;
  const double most = config.max_reprojection_px * config.max_reprojection_px;
  AbsolutePose out{.T_map_body = *start, .inliers = problem.inliers(*start, most)};
  for (int round = 0; round < kRounds && out.inliers.size() >= kLeastInliers; ++round) {
    out.T_map_body = refine(problem, out.inliers, out.T_map_body);
    auto inliers = problem.inliers(out.T_map_body, most);
    if (inliers == out.inliers) break;
    out.inliers = std::move(inliers);
  }
  if (out.inliers.size() < kLeastInliers) return std::nullopt;
  const auto normal = problem.normal_equations(out.inliers, out.T_map_body, false);
  const Eigen::LDLT<Matrix6d> factor(normal.H);
  const double freedom = 2.0 * static_cast<double>(out.inliers.size()) - 6.0;
  out.covariance = factor.solve(Matrix6d::Identity()) * std::max(1.0, normal.chi2 / freedom);
  if (!factor.isPositive() || !out.covariance.allFinite() || out.covariance.diagonal().minCoeff() <= 0.0)
    return std::nullopt;
  out.covariance = (0.5 * (out.covariance + out.covariance.transpose())).eval();
  return out;
}

}  // namespace tutti::visual
