// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/geometry/pose3.hpp"

/// Factors and eigenvalues of the small symmetric matrices that covariances, informations and normal equations are.
/// They are compiled here once: each of Eigen's decompositions costs the compiler seconds in every file that uses it.
/// Only the lower triangle is read.
namespace tutti {

/// error^T covariance^-1 error, the squared Mahalanobis distance; Cholesky, and with pivots where the covariance is
/// not definite: then a direction without variance is left out.
[[nodiscard]] double squared_distance(const Vector6d& error, const Matrix6d& covariance);
[[nodiscard]] double squared_distance(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance);

[[nodiscard]] bool is_definite(const Matrix6d& matrix);

/// The information to a covariance, the covariance to an information; as above where it is not definite.
[[nodiscard]] Matrix6d inverse_of(const Matrix6d& definite);

/// The x with definite * x = right.
[[nodiscard]] Vector6d solve_definite(const Matrix6d& definite, const Vector6d& right);

/// Upper triangular U with U^T U = information: U times a residual has unit covariance.
[[nodiscard]] Matrix6d root_of_information(const Matrix6d& information);
/// Lower triangular W with W^T W = covariance^-1: likewise.
[[nodiscard]] Matrix6d root_of_inverse(const Matrix6d& covariance);

/// Eigenvalues, ascending, and the unit eigenvectors as columns.
struct Eigen3 {
  Eigen::Vector3d values;
  Eigen::Matrix3d vectors;
};
struct Eigen6 {
  Vector6d values;
  Matrix6d vectors;
};
[[nodiscard]] Eigen3 eigen_of(const Eigen::Matrix3d& matrix);
[[nodiscard]] Eigen6 eigen_of(const Matrix6d& matrix);
/// In closed form: faster, and to the root of rounding only. For very many, as the normals of a cloud.
[[nodiscard]] Eigen3 quick_eigen_of(const Eigen::Matrix3d& matrix);

/// The standard deviation along the worst direction.
[[nodiscard]] double largest_sigma(const Eigen::Matrix3d& covariance);

}  // namespace tutti
