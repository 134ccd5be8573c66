// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/registration.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::lidar {
namespace {

constexpr std::size_t kMinCorrespondences = 20;
constexpr double kStepTolerance = 1e-3;       // of the level's distance
constexpr double kMaxNormalAngle_deg = 45.0;  // between the normals of two corresponding points
constexpr double kResidualScale_m = 0.1;      // of the robust loss at the finest level; grows with the level's distance

/// At most `count` indices of points with a normal, evenly spread in storage (= Morton) order, hence in space.
std::vector<std::size_t> sample_surface(const OrientedCloud& cloud, std::size_t count) {
  std::vector<std::size_t> surface;
  surface.reserve(cloud.size());
  for (std::size_t i = 0; i < cloud.size(); ++i)
    if (cloud.normal(i) != Eigen::Vector3f::Zero()) surface.push_back(i);
  if (surface.size() <= count) return surface;
  std::vector<std::size_t> sample(count);
  for (std::size_t k = 0; k < count; ++k) sample[k] = surface[k * surface.size() / count];
  return sample;
}

/// Sums over the correspondences of one pose.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();  // sum w J^T J
  Vector6d g = Vector6d::Zero();  // sum w J^T r
  double weighted_squares = 0.0;  // sum w r^2
  double weights = 0.0;
  double squares = 0.0;                                         // sum r^2
  Eigen::Matrix3d normal_scatter = Eigen::Matrix3d::Zero();     // sum m m^T, source frame
  Eigen::Matrix3d residual_scatter = Eigen::Matrix3d::Zero();   // sum r^2 m m^T, where the roughness is known
  Eigen::Matrix3d roughness_scatter = Eigen::Matrix3d::Zero();  // sum s^2 m m^T, s the roughness
  Eigen::Vector3d point_sum = Eigen::Vector3d::Zero();          // source frame
  std::size_t count = 0;
};

/// Mean over the two points of a correspondence, as far as known; negative when neither is.
double squared_roughness(const OrientedCloud& target, std::size_t j, const OrientedCloud& source, std::size_t i) {
  if (!target.roughness || !source.roughness) return -1.0;
  const double a = (*target.roughness)[j], b = (*source.roughness)[i];
  if (std::isnan(a)) return std::isnan(b) ? -1.0 : b * b;
  return std::isnan(b) ? a * a : 0.5 * (a * a + b * b);
}

/// Residual of a correspondence: r = n_t . (T p_s - q_t); with the right perturbation and m = R^T n_t its Jacobian is
/// J = [m^T, (p_s x m)^T]. Loss: Geman-McClure of the given scale.
NormalEquations linearise(const OrientedCloud& target, const OrientedCloud& source, std::span<const std::size_t> sample,
                          const Pose3& T, double max_distance, double scale, double min_cosine) {
  NormalEquations sums;
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  const Eigen::Matrix3f R_f = R.cast<float>();
  const Eigen::Vector3f t_f = T.translation.cast<float>();
  for (const std::size_t i : sample) {
    const Eigen::Vector3f moved = R_f * source.point(i) + t_f;
    const std::int32_t nearest = target.index->nearest(moved, static_cast<float>(max_distance));
    if (nearest == NeighbourIndex::kNone) continue;
    const auto j = static_cast<std::size_t>(nearest);
    const Eigen::Vector3f& n = target.normal(j);
    if (n.dot(R_f * source.normal(i)) < static_cast<float>(min_cosine)) continue;  // also when n is zero
    const Eigen::Vector3d p = source.point(i).cast<double>();
    const double r = n.cast<double>().dot(R * p + T.translation - target.point(j).cast<double>());
    const double robust = 1.0 / (1.0 + r * r / (scale * scale));
    const double w = robust * robust;
    const Eigen::Vector3d m = R.transpose() * n.cast<double>();
    Vector6d J;
    J << m, p.cross(m);
    sums.H.selfadjointView<Eigen::Lower>().rankUpdate(J, w);
    sums.g += w * r * J;
    sums.weighted_squares += w * r * r;
    sums.weights += w;
    sums.squares += r * r;
    const Eigen::Matrix3d mm = m * m.transpose();
    sums.normal_scatter += mm;
    if (const double rough = squared_roughness(target, j, source, i); rough >= 0.0) {
      sums.residual_scatter += r * r * mm;
      sums.roughness_scatter += rough * mm;
    }
    sums.point_sum += p;
    ++sums.count;
  }
  sums.H = sums.H.selfadjointView<Eigen::Lower>();
  return sums;
}

/// Gauss-Newton at one level; true when the step became small.
bool run_level(const OrientedCloud& target, const OrientedCloud& source, const RegistrationLevel& level,
               const RegistrationConfig& config, double min_cosine, RegistrationResult& result) {
  const auto sample = sample_surface(source, static_cast<std::size_t>(level.max_points));
  const double scale = kResidualScale_m * std::max(1.0, level.max_distance_m / config.overlap_distance_m);
  for (int k = 0; k < level.max_iterations; ++k) {
    const auto sums =
        linearise(target, source, sample, result.T_target_source, level.max_distance_m, scale, min_cosine);
    if (sums.count < kMinCorrespondences) return false;
    // Damping far below one point's weight: keeps directions that nothing constrains where they are.
    const Vector6d step = (sums.H + 1e-6 * sums.weights * Matrix6d::Identity()).ldlt().solve(-sums.g);
    if (!step.allFinite()) return false;
    result.T_target_source = retract(result.T_target_source, step);
    ++result.iterations;
    const Eigen::Vector3d centre = sums.point_sum / static_cast<double>(sums.count);
    const Eigen::Vector3d moved = step.head<3>() + step.tail<3>().cross(centre);
    if (moved.norm() + step.tail<3>().norm() < kStepTolerance * level.max_distance_m) return true;
  }
  return false;
}

/// Root of the largest ratio u^T R u / u^T S u over all directions u. Directions with hardly any surface say nothing.
double worst_ratio(const Eigen::Matrix3d& R, const Eigen::Matrix3d& S, std::size_t count) {
  constexpr double kLeastRoughness = 0.01, kLeastShare = 0.01;  // m; of the points
  const double least = kLeastShare * kLeastRoughness * kLeastRoughness * static_cast<double>(count);
  const Eigen::Matrix3d regular = S + least * Eigen::Matrix3d::Identity();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> solver(R, regular, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
}

void assess(const OrientedCloud& target, const OrientedCloud& source, const RegistrationConfig& config,
            double min_cosine, RegistrationResult& result) {
  const auto sample = sample_surface(source, static_cast<std::size_t>(config.levels.back().max_points));
  const auto sums = linearise(target, source, sample, result.T_target_source, config.overlap_distance_m,
                              kResidualScale_m, min_cosine);
  if (sums.count < kMinCorrespondences) {
    result.converged = false;
    return;
  }
  const auto count = static_cast<double>(sums.count);
  result.overlap = count / static_cast<double>(sample.size());
  result.plane_rmse_m = std::sqrt(sums.squares / count);
  result.overlap_centre_source = sums.point_sum / count;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> facing(sums.normal_scatter / count);
  result.min_translation_eigenvalue = facing.eigenvalues()[0];
  result.weakest_source = facing.eigenvectors().col(0);
  result.misfit = worst_ratio(sums.residual_scatter, sums.roughness_scatter, sums.count);
  // Information of the whole overlap, however few of its points were sampled.
  const auto& normals = *source.normals;
  const auto without = std::count(normals.begin(), normals.end(), Eigen::Vector3f(Eigen::Vector3f::Zero()));
  const double sampled_share =
      static_cast<double>(sample.size()) / static_cast<double>(normals.size() - static_cast<std::size_t>(without));
  const double variance = sums.weighted_squares / sums.weights;
  Vector6d floor;
  floor << Eigen::Vector3d::Constant(config.min_translation_sigma_m),
      Eigen::Vector3d::Constant(config.min_rotation_sigma_rad);
  result.covariance = config.covariance_scale * sampled_share * variance *
                      (sums.H + 1e-6 * sums.weights * Matrix6d::Identity()).inverse();
  result.covariance += Matrix6d(floor.cwiseAbs2().asDiagonal());
}

}  // namespace

RegistrationResult register_clouds(const OrientedCloud& target, const OrientedCloud& source, const Pose3& T_init,
                                   const RegistrationConfig& config) {
  TUTTI_CHECK(!config.levels.empty(), "a registration needs at least one level");
  RegistrationResult result{.T_target_source = T_init};
  if (target.size() == 0 || source.size() == 0) return result;
  const double min_cosine = std::cos(kMaxNormalAngle_deg * kRadPerDeg);
  for (const auto& level : config.levels)
    result.converged = run_level(target, source, level, config, min_cosine, result);
  assess(target, source, config, min_cosine, result);
  return result;
}

std::vector<float> self_residuals(const OrientedCloud& cloud, const RegistrationConfig& config) {
  constexpr std::size_t kTried = 6;  // neighbours, the point itself included
  const auto min_cosine = static_cast<float>(std::cos(kMaxNormalAngle_deg * kRadPerDeg));
  std::vector<float> out(cloud.size(), std::numeric_limits<float>::quiet_NaN());
  std::array<std::int32_t, kTried> neighbours{};
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f &p = cloud.point(i), &n = cloud.normal(i);
    if (n == Eigen::Vector3f::Zero()) continue;
    const std::size_t count = cloud.index->nearest_k(p, neighbours);
    for (std::size_t k = 0; k < count; ++k) {
      const auto j = static_cast<std::size_t>(neighbours[k]);
      if (j == i || cloud.normal(j).dot(n) < min_cosine) continue;
      const Eigen::Vector3f difference = p - cloud.point(j);
      if (difference.norm() < static_cast<float>(config.overlap_distance_m)) out[i] = cloud.normal(j).dot(difference);
      break;
    }
  }
  return out;
}

}  // namespace tutti::lidar
