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
#include "tutti/geometry/symmetric.hpp"

namespace tutti::lidar {
namespace {

constexpr std::size_t kMinCorrespondences = 20;
constexpr double kStepTolerance = 1e-3;       // of the finest level's distance,
constexpr double kCoarseTolerance = 1e-2;     // of that of levels behind which a finer one comes
constexpr double kMaxNormalAngle_deg = 45.0;  // between the normals of two corresponding points
constexpr double kResidualScale_m = 0.1;      // of the robust loss at the finest level; grows with the level's distance

/// At most `count` points with a normal, evenly spread in storage (= Morton) order, hence in space.
std::vector<std::uint32_t> sample_surface(const OrientedCloud& cloud, std::size_t count) {
  const std::vector<std::uint32_t>& surface = *cloud.surface;
  if (surface.size() <= count) return surface;
  std::vector<std::uint32_t> sample(count);
  for (std::size_t k = 0; k < count; ++k) sample[k] = surface[k * surface.size() / count];
  return sample;
}

/// A point of the source and the target point that it lies on.
struct Match {
  std::uint32_t target = 0, source = 0;
};

/// The target points nearest to a sample of the source, from one pose to the next: what was nearest before, nearly is.
class Matcher {
 public:
  Matcher(const OrientedCloud& target, const OrientedCloud& source, std::size_t count)
      : target_(target),
        source_(source),
        sample_(sample_surface(source, count)),
        nearest_(sample_.size(), NeighbourIndex::kNone) {}
  [[nodiscard]] std::size_t size() const { return sample_.size(); }

  /// Where points are closer than this and their normals alike.
  std::span<const Match> at(const Pose3& T_target_source, double max_distance) {
    const auto min_cosine = static_cast<float>(std::cos(kMaxNormalAngle_deg * kRadPerDeg));
    const Eigen::Matrix3f R = T_target_source.rotation.toRotationMatrix().cast<float>();
    const Eigen::Vector3f t = T_target_source.translation.cast<float>();
    matches_.clear();
    for (std::size_t k = 0; k < sample_.size(); ++k) {
      const std::uint32_t i = sample_[k];
      std::int32_t& j = nearest_[k];
      j = target_.index->nearest(R * source_.point(i) + t, static_cast<float>(max_distance), j);
      if (j == NeighbourIndex::kNone) continue;
      const Eigen::Vector3f& n = target_.normal(static_cast<std::size_t>(j));
      if (n.dot(R * source_.normal(i)) < min_cosine) continue;  // also when n is zero
      matches_.push_back({static_cast<std::uint32_t>(j), i});
    }
    return matches_;
  }

 private:
  const OrientedCloud& target_;
  const OrientedCloud& source_;
  std::vector<std::uint32_t> sample_;
  std::vector<std::int32_t> nearest_;
  std::vector<Match> matches_;
};

/// r = n_t . (T p_s - q_t); with the right perturbation and m = R^T n_t its gradient is [m; p_s x m]. Loss:
/// Geman-McClure of the given scale.
struct Residual {
  double r = 0.0, weight = 1.0;
  Vector6d gradient;
};

Residual residual_of(const OrientedCloud& target, const OrientedCloud& source, const Match& match,
                     const Eigen::Matrix3d& R, const Eigen::Vector3d& t, double scale) {
  const Eigen::Vector3d p = source.point(match.source).cast<double>(), n = target.normal(match.target).cast<double>();
  Residual out;
  out.r = n.dot(R * p + t - target.point(match.target).cast<double>());
  const double robust = 1.0 / (1.0 + out.r * out.r / (scale * scale));
  out.weight = robust * robust;
  const Eigen::Vector3d m = R.transpose() * n;
  out.gradient << m, p.cross(m);
  return out;
}

/// Sums over the matches at one pose.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();  // sum w J^T J
  Vector6d g = Vector6d::Zero();  // sum w J^T r
  double weights = 0.0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // of the matched points, source frame

  /// Damping far below one point's weight: keeps directions that nothing constrains where they are.
  [[nodiscard]] Matrix6d damped() const { return H + 1e-6 * weights * Matrix6d::Identity(); }
};

NormalEquations linearise(const OrientedCloud& target, const OrientedCloud& source, std::span<const Match> matches,
                          const Pose3& T, double scale) {
  NormalEquations sums;
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  for (const Match& match : matches) {
    const Residual residual = residual_of(target, source, match, R, T.translation, scale);
    sums.H.selfadjointView<Eigen::Lower>().rankUpdate(residual.gradient, residual.weight);
    sums.g += residual.weight * residual.r * residual.gradient;
    sums.weights += residual.weight;
    sums.centre += source.point(match.source).cast<double>();
  }
  sums.H = sums.H.selfadjointView<Eigen::Lower>();
  sums.centre /= std::max(1.0, static_cast<double>(matches.size()));
  return sums;
}

/// Gauss-Newton at one level; true when the step became small.
bool run_level(const OrientedCloud& target, const OrientedCloud& source, const RegistrationLevel& level,
               const RegistrationConfig& config, RegistrationResult& result) {
  Matcher matcher(target, source, static_cast<std::size_t>(level.max_points));
  const double scale = kResidualScale_m * std::max(1.0, level.max_distance_m / config.overlap_distance_m);
  const double tolerance = level.max_distance_m > config.overlap_distance_m ? kCoarseTolerance : kStepTolerance;
  for (int k = 0; k < level.max_iterations; ++k) {
    const auto matches = matcher.at(result.T_target_source, level.max_distance_m);
    if (matches.size() < kMinCorrespondences) return false;
    const auto sums = linearise(target, source, matches, result.T_target_source, scale);
    const Vector6d step = solve_definite(sums.damped(), -sums.g);
    if (!step.allFinite()) return false;
    result.T_target_source = retract(result.T_target_source, step);
    ++result.iterations;
    const Eigen::Vector3d moved = step.head<3>() + step.tail<3>().cross(sums.centre);
    if (moved.norm() + step.tail<3>().norm() < tolerance * level.max_distance_m) return true;
  }
  return false;
}

/// Mean over the two points of a match, as far as known; negative when neither is.
double squared_roughness(const OrientedCloud& target, const OrientedCloud& source, const Match& match) {
  if (!target.roughness || !source.roughness) return -1.0;
  const double a = (*target.roughness)[match.target], b = (*source.roughness)[match.source];
  if (std::isnan(a)) return std::isnan(b) ? -1.0 : b * b;
  return std::isnan(b) ? a * a : 0.5 * (a * a + b * b);
}

/// Covariance of least squares whose residuals are correlated: H^-1 times the variance of one independent residual, as
/// the sums of the terms w r J over batches of neighbours show it. Terms follow each other as points do in storage,
/// near in space; batches are doubled as long as enough of them are left, and the size that shows most counts [batch
/// means: Law & Carson 1979].
Matrix6d residual_covariance(const Matrix6d& H, std::span<const Vector6d> terms) {
  constexpr std::size_t kFewestBatches = 12;
  const Eigen::LLT<Matrix6d> cholesky(H);
  std::vector<Vector6d> sums(terms.begin(), terms.end());
  for (Vector6d& sum : sums) cholesky.matrixL().solveInPlace(sum);
  double variance = 0.0;
  for (std::size_t n = sums.size();;) {
    double squares = 0.0;
    for (std::size_t i = 0; i < n; ++i) squares += sums[i].squaredNorm();
    const auto count = static_cast<double>(n);
    variance = std::max(variance, squares / 6.0 * count / std::max(1.0, count - 6.0));  // six degrees are fitted
    if (n / 2 < kFewestBatches) break;
    n /= 2;
    for (std::size_t i = 0; i < n; ++i) sums[i] = sums[2 * i] + sums[2 * i + 1];
  }
  return variance * cholesky.solve(Matrix6d::Identity());
}

/// Root of the largest ratio u^T R u / u^T S u over all directions u. Directions with hardly any surface are ignored.
double worst_ratio(const Eigen::Matrix3d& R, const Eigen::Matrix3d& S, std::size_t count) {
  constexpr double kLeastRoughness = 0.01, kLeastShare = 0.01;  // m; of the points
  const double least = kLeastShare * kLeastRoughness * kLeastRoughness * static_cast<double>(count);
  const Eigen::Matrix3d regular = S + least * Eigen::Matrix3d::Identity();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix3d> solver(R, regular, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, solver.eigenvalues()[2]));
}

/// Where the clouds lie on each other, sums of outer products of normals (source frame).
struct Scatter {
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();    // sum m m^T
  Eigen::Matrix3d residuals = Eigen::Matrix3d::Zero();  // sum r^2 m m^T, where the roughness is known
  Eigen::Matrix3d roughness = Eigen::Matrix3d::Zero();  // sum s^2 m m^T, s the roughness
  double squares = 0.0;                                 // sum r^2
};

void assess(const OrientedCloud& target, const OrientedCloud& source, const RegistrationConfig& config,
            RegistrationResult& result) {
  Matcher matcher(target, source, static_cast<std::size_t>(config.levels.back().max_points));
  const Pose3& T = result.T_target_source;
  const auto matches = matcher.at(T, config.overlap_distance_m);
  if (matches.size() < kMinCorrespondences) {
    result.converged = false;
    return;
  }
  const auto sums = linearise(target, source, matches, T, kResidualScale_m);
  const Eigen::Matrix3d R = T.rotation.toRotationMatrix();
  std::vector<Vector6d> terms;
  terms.reserve(matches.size());
  Scatter scatter;
  for (const Match& match : matches) {
    const Residual residual = residual_of(target, source, match, R, T.translation, kResidualScale_m);
    terms.emplace_back(residual.weight * residual.r * residual.gradient);
    const double square = residual.r * residual.r;
    const Eigen::Matrix3d mm = residual.gradient.head<3>() * residual.gradient.head<3>().transpose();
    scatter.squares += square;
    scatter.normals += mm;
    if (const double rough = squared_roughness(target, source, match); rough >= 0.0) {
      scatter.residuals += square * mm;
      scatter.roughness += rough * mm;
    }
  }
  const auto count = static_cast<double>(matches.size());
  result.overlap = count / static_cast<double>(matcher.size());
  result.plane_rmse_m = std::sqrt(scatter.squares / count);
  result.overlap_centre_source = sums.centre;
  const Eigen3 facing = eigen_of(Eigen::Matrix3d(scatter.normals / count));
  result.min_translation_eigenvalue = facing.values[0];
  result.weakest_source = facing.vectors.col(0);
  result.misfit = worst_ratio(scatter.residuals, scatter.roughness, matches.size());
  result.covariance = residual_covariance(sums.damped(), terms);
}

}  // namespace

RegistrationResult register_clouds(const OrientedCloud& target, const OrientedCloud& source, const Pose3& T_init,
                                   const RegistrationConfig& config) {
  TUTTI_CHECK(!config.levels.empty(), "a registration needs at least one level");
  RegistrationResult result{.T_target_source = T_init};
  if (target.size() == 0 || source.size() == 0) return result;
  for (const auto& level : config.levels) result.converged = run_level(target, source, level, config, result);
  assess(target, source, config, result);
  return result;
}

std::vector<Contact> find_contacts(const OrientedCloud& target, const OrientedCloud& source,
                                   const Pose3& T_target_source, std::size_t count, const RegistrationConfig& config) {
  Matcher matcher(target, source, count);
  const Eigen::Matrix3d R = T_target_source.rotation.toRotationMatrix();
  std::vector<Contact> contacts;
  for (const Match& match : matcher.at(T_target_source, config.overlap_distance_m)) {
    const Residual residual = residual_of(target, source, match, R, T_target_source.translation, kResidualScale_m);
    contacts.push_back({target.point(match.target).cast<double>(), source.point(match.source).cast<double>(),
                        residual.gradient, residual.weight});
  }
  return contacts;
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
