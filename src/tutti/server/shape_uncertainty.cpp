// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/server/shape_uncertainty.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "tutti/base/check.hpp"
#include "tutti/geometry/so3.hpp"
#include "tutti/server/displacements.hpp"
#include "tutti/server/worst_sigma.hpp"

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

/// What is known of the errors of one kind, positions or rotations.
class Doubt {
 public:
  explicit Doubt(std::size_t nodes) : nodes_(static_cast<double>(nodes)) {
    while (const std::size_t count = ShapeUncertainty::stretches(nodes, stretches_.size()))
      stretches_.emplace_back(count);
  }
  /// One of many that the nodes may be off by.
  void add_sample(const Eigen::Matrix3Xd& x) {
    ++samples_;
    squares_ += x.squaredNorm();
    for_each_sag(x, [](Stretch& stretch, const Eigen::Vector3d& sag) { stretch.scatter += sag * sag.transpose(); });
  }
  /// What they would move by if one closure were wrong.
  void add_shift(const Eigen::Matrix3Xd& x) {
    largest_squares_ = std::max(largest_squares_, x.squaredNorm());
    for_each_sag(x, [](Stretch& stretch, const Eigen::Vector3d& sag) {
      stretch.largest = std::max(stretch.largest, sag.norm());
    });
  }
  [[nodiscard]] double whole() const { return std::sqrt((squares_ / samples_ + largest_squares_) / nodes_); }
  [[nodiscard]] double sag(std::size_t scale, std::size_t i) const {
    const Stretch& stretch = stretches_[scale][i];
    return std::hypot(worst_sigma(stretch.scatter, samples_), stretch.largest);
  }

 private:
  struct Stretch {
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
    double largest = 0.0;
  };
  /// What the middle of each stretch is off by when its ends are held.
  template <class Take>
  void for_each_sag(const Eigen::Matrix3Xd& x, const Take& take) {
    auto L = static_cast<Eigen::Index>(ShapeUncertainty::kShortest);
    for (auto& stretches : stretches_) {
      Eigen::Index a = 0;
      for (Stretch& stretch : stretches) {
        take(stretch, Eigen::Vector3d(x.col(a + L) - 0.5 * (x.col(a) + x.col(a + 2 * L))));
        a += 2 * L;
      }
      L *= 2;
    }
  }

  double nodes_;
  double samples_ = 0.0;
  double squares_ = 0.0;          ///< |x|^2 of all nodes, over all samples.
  double largest_squares_ = 0.0;  ///< ... the largest of all shifts.
  std::vector<std::vector<Stretch>> stretches_;
};

}  // namespace

ShapeUncertainty shape_uncertainty(const ChainId& chain, std::span<const Pose3> poses, const Eigen::MatrixXd& samples,
                                   const Eigen::MatrixXd& shifts) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  TUTTI_CHECK(n > 0 && samples.rows() == 6 * n && samples.cols() > 0, "{} x {} samples of {} poses", samples.rows(),
              samples.cols(), n);
  TUTTI_CHECK(shifts.cols() == 0 || shifts.rows() == 6 * n, "{} x {} shifts of {} poses", shifts.rows(), shifts.cols(),
              n);
  Eigen::Matrix3Xd points(3, n);
  for (Eigen::Index k = 0; k < n; ++k) points.col(k) = poses[static_cast<std::size_t>(k)].translation;
  const RigidMotionFilter filter(std::move(points));
  Doubt position(poses.size());
  Doubt rotation(poses.size());
  const auto for_each = [&](const Eigen::MatrixXd& tangents, const auto& take) {
    const Displacements all(poses, tangents);
    for (Eigen::Index s = 0; s < tangents.cols(); ++s) {
      Eigen::Matrix3Xd x_m = all.position_m.col(s).reshaped(3, n);
      Eigen::Matrix3Xd x_rad = all.rotation_rad.col(s).reshaped(3, n);
      filter.apply(x_m);
      x_rad.colwise() -= Eigen::Vector3d(x_rad.rowwise().mean());
      take(x_m, x_rad);
    }
  };
  for_each(samples, [&](const Eigen::Matrix3Xd& x_m, const Eigen::Matrix3Xd& x_rad) {
    position.add_sample(x_m);
    rotation.add_sample(x_rad);
  });
  for_each(shifts, [&](const Eigen::Matrix3Xd& x_m, const Eigen::Matrix3Xd& x_rad) {
    position.add_shift(x_m);
    rotation.add_shift(x_rad);
  });

  ShapeUncertainty out{.chain = chain, .whole = {position.whole(), rotation.whole()}, .sag = {}};
  for (std::size_t j = 0; const std::size_t count = ShapeUncertainty::stretches(poses.size(), j); ++j) {
    auto& stretches = out.sag.emplace_back();
    for (std::size_t i = 0; i < count; ++i) stretches.push_back({position.sag(j, i), rotation.sag(j, i)});
  }
  return out;
}

}  // namespace tutti::server
