// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <google/protobuf/repeated_field.h>

#include "tutti/geometry/covariance.hpp"
#include "tutti/geometry/pose3.hpp"

/// Poses and covariances as they are, not rounded.
namespace tutti::wire {

using Numbers = google::protobuf::RepeatedField<double>;

/// Translation, then the quaternion x y z w.
inline constexpr int kPoseNumbers = 7;
/// The upper triangle by rows.
inline constexpr int kCovarianceNumbers = 21;

inline void write(const Pose3& T, Numbers& out) {
  for (const double x : T.translation) out.Add(x);
  for (const double q : T.rotation.coeffs()) out.Add(q);
}

/// The kPoseNumbers from `at` on, which are there. Not validated.
inline Pose3 read_pose(const Numbers& in, int at) {
  Pose3 T;
  for (int i = 0; i < 3; ++i) T.translation(i) = in.Get(at + i);
  for (int i = 0; i < 4; ++i) T.rotation.coeffs()(i) = in.Get(at + 3 + i);
  return T;
}

inline void write(const Matrix6d& covariance, Numbers& out) {
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) out.Add(covariance(i, j));
}

/// The kCovarianceNumbers from `at` on, which are there. Not validated.
inline Matrix6d read_covariance(const Numbers& in, int at) {
  Matrix6d covariance;
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j, ++at) covariance(i, j) = covariance(j, i) = in.Get(at);
  return covariance;
}

}  // namespace tutti::wire
