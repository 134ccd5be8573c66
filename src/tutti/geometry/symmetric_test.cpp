// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/geometry/symmetric.hpp"

#include <gtest/gtest.h>
// gtest first
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <limits>

#include "tutti/base/random.hpp"

namespace tutti {
namespace symmetric_test {

/// A A^T, regular by 0.01; metres and radians differ by 100.
template <int N>
Eigen::Matrix<double, N, N> definite(Rng& rng) {
  Eigen::Matrix<double, N, N> A;
  for (int i = 0; i < N * N; ++i) A(i) = rng.normal(1.0);
  Eigen::Matrix<double, N, 1> scale;
  for (int i = 0; i < N; ++i) scale(i) = i < 3 ? 1.0 : 0.01;
  const Eigen::Matrix<double, N, N> C = A * A.transpose() + 0.01 * Eigen::Matrix<double, N, N>::Identity();
  return scale.asDiagonal() * C * scale.asDiagonal();
}

template <int N>
Eigen::Matrix<double, N, 1> drawn(Rng& rng) {
  Eigen::Matrix<double, N, 1> out;
  for (int i = 0; i < N; ++i) out(i) = rng.normal(1.0);
  return out;
}

RC_GTEST_PROP(Symmetric, FactorsAndInversesGiveTheMatrixBack, (std::uint64_t seed)) {
  Rng rng(seed);
  const Matrix6d C = definite<6>(rng), inverse = inverse_of(C);
  const Vector6d error = drawn<6>(rng);
  RC_ASSERT((C * inverse).isApprox(Matrix6d::Identity(), 1e-6));
  RC_ASSERT(is_definite(C));
  const double expected = error.dot(inverse * error);
  RC_ASSERT(std::abs(squared_distance(error, C) - expected) <= 1e-6 * expected);
  RC_ASSERT((C * solve_definite(C, error)).isApprox(error, 1e-6));
  const Matrix6d U = root_of_information(C), W = root_of_inverse(C);
  RC_ASSERT((U.transpose() * U).isApprox(C, 1e-9));
  RC_ASSERT((W.transpose() * W).isApprox(inverse, 1e-6));
  RC_ASSERT(U.isUpperTriangular() && W.isLowerTriangular());
}

RC_GTEST_PROP(Symmetric, EigenvaluesAscendAndTheirVectorsGiveTheMatrixBack, (std::uint64_t seed)) {
  Rng rng(seed);
  const Eigen::Matrix3d C = definite<3>(rng);
  const auto sixfold = eigen_of(definite<6>(rng));
  RC_ASSERT((sixfold.values.head<5>().array() <= sixfold.values.tail<5>().array()).all());
  for (const auto& [values, vectors] : {eigen_of(C), quick_eigen_of(C)}) {
    RC_ASSERT(values(0) <= values(1) && values(1) <= values(2));
    RC_ASSERT((vectors * values.asDiagonal() * vectors.transpose()).isApprox(C, 1e-5));
  }
  const Eigen::Vector3d direction = drawn<3>(rng).normalized();
  RC_ASSERT(direction.dot(C * direction) <= std::pow(largest_sigma(C), 2) * (1.0 + 1e-9));
  const Eigen::Vector3d error = drawn<3>(rng);
  RC_ASSERT((C * C.inverse()).isApprox(Eigen::Matrix3d::Identity(), 1e-6));
  RC_ASSERT(std::abs(squared_distance(error, C) / error.dot(C.inverse() * error) - 1.0) < 1e-6);
}

TEST(Symmetric, DirectionsWithoutVarianceAreLeftOut) {
  Matrix6d in_the_plane = Matrix6d::Identity();
  for (const int flat : {2, 3, 4}) in_the_plane(flat, flat) = 0.0;
  EXPECT_FALSE(is_definite(in_the_plane));
  EXPECT_NEAR(squared_distance(Vector6d::Ones(), in_the_plane), 3.0, 1e-12);
  EXPECT_TRUE(inverse_of(in_the_plane).isApprox(in_the_plane));
  const Eigen::Vector3d ones = Eigen::Vector3d::Ones();
  const Eigen::Matrix3d flat = Eigen::Vector3d(4.0, 0.0, 1.0).asDiagonal();
  EXPECT_NEAR(squared_distance(ones, flat), 1.25, 1e-12);
}

TEST(Symmetric, NothingThatIsNotFiniteIsDefinite) {
  Matrix6d wrong = Matrix6d::Identity();
  wrong(3, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(is_definite(wrong));
  EXPECT_FALSE(is_definite(-Matrix6d::Identity()));
}

}  // namespace symmetric_test
}  // namespace tutti
