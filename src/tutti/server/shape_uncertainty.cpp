// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/shape_uncertainty.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"

namespace tutti::server {
namespace {

/// Turns about axes with less than this share of the largest moment of inertia move nothing and are not looked for.
constexpr double kSmallestInertiaShare = 1e-12;

/// Removes the best-fitting small rigid motion from displacements of fixed points.
class RigidMotionFilter {
 public:
  explicit RigidMotionFilter(Eigen::Matrix3Xd points) : arms_(std::move(points)) {
    arms_.colwise() -= Eigen::Vector3d(arms_.rowwise().mean());
    const Eigen::Matrix3d scatter = arms_ * arms_.transpose();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> inertia(scatter.trace() * Eigen::Matrix3d::Identity() -
                                                                 scatter);
    const double smallest = kSmallestInertiaShare * inertia.eigenvalues().maxCoeff();
    const Eigen::Vector3d inverse =
        inertia.eigenvalues().unaryExpr([&](double value) { return value > smallest ? 1.0 / value : 0.0; });
    inverse_inertia_ = inertia.eigenvectors() * inverse.asDiagonal() * inertia.eigenvectors().transpose();
  }
  void apply(Eigen::Matrix3Xd& displacements) const {
    displacements.colwise() -= Eigen::Vector3d(displacements.rowwise().mean());
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    for (Eigen::Index k = 0; k < arms_.cols(); ++k) moment += arms_.col(k).cross(displacements.col(k));
    displacements -= skew(inverse_inertia_ * moment) * arms_;
  }

 private:
  Eigen::Matrix3Xd arms_;  ///< From the centroid.
  Eigen::Matrix3d inverse_inertia_;
};

/// What the middle of each stretch is off by when its ends are held: take(stretch, sag) for every stretch of every
/// scale, `of` laid out as ShapeUncertainty::sag.
template <class Stretch, class Take>
void for_each_sag(const Eigen::Matrix3Xd& x, std::vector<std::vector<Stretch>>& of, const Take& take) {
  auto L = static_cast<Eigen::Index>(ShapeUncertainty::kShortest);
  for (auto& stretches : of) {
    Eigen::Index a = 0;
    for (Stretch& stretch : stretches) {
      take(stretch, Eigen::Vector3d(x.col(a + L) - 0.5 * (x.col(a) + x.col(a + 2 * L))));
      a += 2 * L;
    }
    L *= 2;
  }
}

template <class Stretch>
std::vector<std::vector<Stretch>> per_stretch(std::size_t nodes, const Stretch& value) {
  std::vector<std::vector<Stretch>> out;
  while (const std::size_t count = ShapeUncertainty::stretches(nodes, out.size())) out.emplace_back(count, value);
  return out;
}

/// Standard deviation in the worst direction. The largest eigenvalue of few samples' covariance S is too large when the
/// true ones are alike, so S is first drawn towards tr(S) / 3 I as far as the samples ask for (oracle approximating
/// shrinkage: Chen, Wiesel, Eldar, Hero, "Shrinkage algorithms for MMSE covariance estimation", 2010, eq. 23).
double worst_sigma(const Eigen::Matrix3d& scatter, double samples) {
  const Eigen::Matrix3d S = scatter / samples;
  const double trace = S.trace();
  if (!(trace > 0.0)) return 0.0;
  const double squares = S.squaredNorm();
  const double spread = (samples + 1.0 / 3.0) * (squares - trace * trace / 3.0);
  const double wanted = squares / 3.0 + trace * trace;
  const double share = wanted < spread ? wanted / spread : 1.0;
  const double largest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(S, Eigen::EigenvaluesOnly).eigenvalues()(2);
  return std::sqrt((1.0 - share) * largest + share * trace / 3.0);
}

/// Displacements of a robot's nodes in the axes of `world`, positions less their rigid motion, rotations less their
/// mean.
class Displacements {
 public:
  explicit Displacements(std::span<const Pose3> poses)
      : filter_(positions(poses)), m(3, static_cast<Eigen::Index>(poses.size())), rad(m) {
    for (const Pose3& pose : poses) R_.push_back(pose.rotation.toRotationMatrix());
  }
  /// From right tangents, 6 per node.
  void assign(const Eigen::Ref<const Eigen::VectorXd>& tangents) {
    for (Eigen::Index k = 0; k < m.cols(); ++k) {
      m.col(k) = R_[static_cast<std::size_t>(k)] * tangents.segment<3>(6 * k);
      rad.col(k) = R_[static_cast<std::size_t>(k)] * tangents.segment<3>(6 * k + 3);
    }
    filter_.apply(m);
    rad.colwise() -= Eigen::Vector3d(rad.rowwise().mean());
  }

 private:
  static Eigen::Matrix3Xd positions(std::span<const Pose3> poses) {
    Eigen::Matrix3Xd out(3, static_cast<Eigen::Index>(poses.size()));
    for (std::size_t k = 0; k < poses.size(); ++k) out.col(static_cast<Eigen::Index>(k)) = poses[k].translation;
    return out;
  }
  RigidMotionFilter filter_;
  std::vector<Eigen::Matrix3d> R_;

 public:
  Eigen::Matrix3Xd m;
  Eigen::Matrix3Xd rad;
};

}  // namespace

ShapeUncertainty shape_uncertainty(RobotId robot, std::span<const Pose3> poses, const Eigen::MatrixXd& samples,
                                   const Eigen::MatrixXd& shifts) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  TUTTI_CHECK(n > 0 && samples.rows() == 6 * n && samples.cols() > 0, "{} x {} samples of {} poses", samples.rows(),
              samples.cols(), n);
  TUTTI_CHECK(shifts.cols() == 0 || shifts.rows() == 6 * n, "{} x {} shifts of {} poses", shifts.rows(), shifts.cols(),
              n);
  Displacements x(poses);
  const auto add = [](Eigen::Matrix3d& scatter, const Eigen::Vector3d& sag) { scatter += sag * sag.transpose(); };
  auto position = per_stretch<Eigen::Matrix3d>(poses.size(), Eigen::Matrix3d::Zero());
  auto rotation = position;
  double squared_m = 0.0, squared_rad = 0.0;  // of all nodes, mean over the samples
  const auto count = static_cast<double>(samples.cols());
  for (Eigen::Index s = 0; s < samples.cols(); ++s) {
    x.assign(samples.col(s));
    squared_m += x.m.squaredNorm() / count;
    squared_rad += x.rad.squaredNorm() / count;
    for_each_sag(x.m, position, add);
    for_each_sag(x.rad, rotation, add);
  }
  const auto raise = [](double& most, const Eigen::Vector3d& sag) { most = std::max(most, sag.norm()); };
  auto most_m = per_stretch(poses.size(), 0.0);
  auto most_rad = most_m;
  double most_squared_m = 0.0, most_squared_rad = 0.0;
  for (Eigen::Index s = 0; s < shifts.cols(); ++s) {
    x.assign(shifts.col(s));
    most_squared_m = std::max(most_squared_m, x.m.squaredNorm());
    most_squared_rad = std::max(most_squared_rad, x.rad.squaredNorm());
    for_each_sag(x.m, most_m, raise);
    for_each_sag(x.rad, most_rad, raise);
  }

  ShapeUncertainty out{.robot = robot};
  out.whole = {std::sqrt((squared_m + most_squared_m) / static_cast<double>(n)),
               std::sqrt((squared_rad + most_squared_rad) / static_cast<double>(n))};
  for (std::size_t j = 0; j < position.size(); ++j) {
    auto& stretches = out.sag.emplace_back();
    for (std::size_t i = 0; i < position[j].size(); ++i)
      stretches.push_back({std::hypot(worst_sigma(position[j][i], count), most_m[j][i]),
                           std::hypot(worst_sigma(rotation[j][i], count), most_rad[j][i])});
  }
  return out;
}

}  // namespace tutti::server
