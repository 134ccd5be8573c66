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

/// Sums of x x^T over samples, of what the middle of each stretch is off by when its ends are held.
struct Scatter {
  std::vector<std::vector<Eigen::Matrix3d>> of;  ///< As ShapeUncertainty::sag.

  explicit Scatter(std::size_t nodes) {
    while (const std::size_t count = ShapeUncertainty::stretches(nodes, of.size()))
      of.emplace_back(count, Eigen::Matrix3d::Zero());
  }
  void add(const Eigen::Matrix3Xd& x) {
    auto L = static_cast<Eigen::Index>(ShapeUncertainty::kShortest);
    for (auto& stretches : of) {
      Eigen::Index a = 0;
      for (Eigen::Matrix3d& stretch : stretches) {
        const Eigen::Vector3d sag = x.col(a + L) - 0.5 * (x.col(a) + x.col(a + 2 * L));
        stretch += sag * sag.transpose();
        a += 2 * L;
      }
      L *= 2;
    }
  }
};

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

}  // namespace

ShapeUncertainty shape_uncertainty(RobotId robot, std::span<const Pose3> poses, const Eigen::MatrixXd& samples) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  TUTTI_CHECK(n > 0 && samples.rows() == 6 * n && samples.cols() > 0, "{} x {} samples of {} poses", samples.rows(),
              samples.cols(), n);
  Eigen::Matrix3Xd points(3, n);
  std::vector<Eigen::Matrix3d> R;
  for (const Pose3& pose : poses) {
    points.col(static_cast<Eigen::Index>(R.size())) = pose.translation;
    R.push_back(pose.rotation.toRotationMatrix());
  }
  const RigidMotionFilter filter(std::move(points));
  Scatter position(poses.size());
  Scatter rotation(poses.size());
  double squared_m = 0.0;
  double squared_rad = 0.0;
  Eigen::Matrix3Xd x_m(3, n);
  Eigen::Matrix3Xd x_rad(3, n);
  for (Eigen::Index s = 0; s < samples.cols(); ++s) {
    for (Eigen::Index k = 0; k < n; ++k) {
      x_m.col(k) = R[static_cast<std::size_t>(k)] * samples.col(s).segment<3>(6 * k);
      x_rad.col(k) = R[static_cast<std::size_t>(k)] * samples.col(s).segment<3>(6 * k + 3);
    }
    filter.apply(x_m);
    x_rad.colwise() -= Eigen::Vector3d(x_rad.rowwise().mean());
    squared_m += x_m.squaredNorm();
    squared_rad += x_rad.squaredNorm();
    position.add(x_m);
    rotation.add(x_rad);
  }

  const auto count = static_cast<double>(samples.cols());
  ShapeUncertainty out{.robot = robot};
  out.whole = {std::sqrt(squared_m / (count * static_cast<double>(n))),
               std::sqrt(squared_rad / (count * static_cast<double>(n)))};
  for (std::size_t j = 0; j < position.of.size(); ++j) {
    auto& stretches = out.sag.emplace_back();
    for (std::size_t i = 0; i < position.of[j].size(); ++i)
      stretches.push_back({worst_sigma(position.of[j][i], count), worst_sigma(rotation.of[j][i], count)});
  }
  return out;
}

}  // namespace tutti::server
