// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/symmetric.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace tutti {
namespace {

template <class Matrix, class Right>
Right solved(const Matrix& matrix, const Right& right) {
  const Eigen::LLT<Matrix> cholesky(matrix);
  if (cholesky.info() == Eigen::Success) return cholesky.solve(right);
  return matrix.ldlt().solve(right);
}

}  // namespace

double squared_distance(const Vector6d& error, const Matrix6d& covariance) {
  return error.dot(solved(covariance, error));
}
double squared_distance(const Eigen::Vector3d& error, const Eigen::Matrix3d& covariance) {
  return error.dot(solved(covariance, error));
}

bool is_definite(const Matrix6d& matrix) { return matrix.allFinite() && matrix.llt().info() == Eigen::Success; }

Matrix6d inverse_of(const Matrix6d& definite) { return solved<Matrix6d, Matrix6d>(definite, Matrix6d::Identity()); }

Vector6d solve_definite(const Matrix6d& definite, const Vector6d& right) { return definite.ldlt().solve(right); }

Matrix6d root_of_information(const Matrix6d& information) { return information.llt().matrixU(); }

Matrix6d root_of_inverse(const Matrix6d& covariance) { return covariance.llt().matrixL().solve(Matrix6d::Identity()); }

Eigen3 eigen_of(const Eigen::Matrix3d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen6 eigen_of(const Matrix6d& matrix) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

Eigen3 quick_eigen_of(const Eigen::Matrix3d& matrix) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
  solver.computeDirect(matrix);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

double largest_sigma(const Eigen::Matrix3d& covariance) { return std::sqrt(eigen_of(covariance).values(2)); }

}  // namespace tutti
