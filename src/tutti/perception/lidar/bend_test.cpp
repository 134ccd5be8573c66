// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/bend.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "support/perception/lidar/rooms.hpp"
#include "tutti/geometry/symmetric.hpp"

namespace tutti::lidar {
namespace bend_test {

using namespace test;

/// A submap that comes past all of a room of 8 x 5 x 3 m, with odometry that errs by this much per step.
Bend walked(double sigma) {
  return find_bend(make_submap({RobotId{0}, 0}, {}, {.to = {9, 6, 1.2}, .odometry_sigma = sigma}, Rng(1)));
}

/// Points all over the room, with normals of any direction.
std::vector<Contact> contacts_in_a_room(const Pose3& T_target_source, Rng rng) {
  std::vector<Contact> out(300);
  for (Contact& contact : out) {
    contact.source = {rng.uniform(-1, 7), rng.uniform(-3, 2), rng.uniform(-1, 2)};
    contact.target = T_target_source * contact.source;
    const Eigen::Vector3d m = Eigen::Vector3d(rng.normal(), rng.normal(), rng.normal()).normalized();
    contact.gradient << m, contact.source.cross(m);
  }
  return out;
}

/// Share of point p that was seen from the keyframes up to k, or from k on.
double share_beyond(const Bend& bend, const Eigen::Vector3d& p, std::size_t first, std::size_t last) {
  double sum = 0.0, all = 0.0;
  for (std::size_t k = 0; k < bend.viewpoints.size(); ++k) {
    const double density = 1.0 / ((bend.viewpoints[k] - p).squaredNorm() + 0.25);
    all += density;
    if (first <= k && k <= last) sum += density;
  }
  return sum / all;
}

/// By how far the bent points of one submap move the registration: least squares over the contacts.
Vector6d shift_by(const Bend& bend, const std::vector<Vector6d>& errors, std::span<const Contact> contacts) {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  for (const Contact& contact : contacts) {
    Vector6d twist = Vector6d::Zero();
    for (std::size_t k = 0; k < errors.size(); ++k)
      twist += errors[k] * (k < bend.middle ? share_beyond(bend, contact.source, 0, k)
                                            : share_beyond(bend, contact.source, k + 1, errors.size()));
    H += contact.gradient * contact.gradient.transpose();
    g += contact.gradient * contact.gradient.dot(twist);
  }
  return solve_definite(H, -g);
}

TEST(BendCovariance, isThatOfTheLeastSquaresOfBentSubmaps) {
  const Bend bent = walked(0.01), straight = walked(1e-9);
  const auto contacts = contacts_in_a_room({}, Rng(2));
  const Matrix6d C = bend_covariance(straight, bent, {}, contacts);
  Rng rng(3);
  double nees = 0.0;
  constexpr int kRuns = 300;
  for (int run = 0; run < kRuns; ++run) {
    std::vector<Vector6d> errors;
    for (const Matrix6d& step : bent.steps) {
      Vector6d drawn;
      for (double& x : drawn) x = rng.normal();
      errors.emplace_back(step.llt().matrixL() * drawn);
    }
    const Vector6d shift = shift_by(bent, errors, contacts);
    nees += squared_distance(shift, C) / kRuns;
  }
  EXPECT_NEAR(nees, 6.0, 0.6);  // three standard deviations
}

TEST(BendCovariance, countsBothSubmapsAlike) {
  const Bend bent = walked(0.01), straight = walked(1e-9);
  const auto contacts = contacts_in_a_room({}, Rng(2));
  const Matrix6d source = bend_covariance(straight, bent, {}, contacts),
                 target = bend_covariance(bent, straight, {}, contacts),
                 both = bend_covariance(bent, bent, {}, contacts);
  EXPECT_TRUE(source.isApprox(target, 1e-6));
  EXPECT_TRUE(both.isApprox(source + target, 1e-6));
}

// Points round the middle were mostly seen from there.
TEST(BendCovariance, isSmallerWhereTheCloudsTouchNearTheMiddleKeyframes) {
  const Bend bent = walked(0.01);
  auto near = contacts_in_a_room({}, Rng(2)), far = near;
  for (auto [contacts, at] : {std::pair(&near, bent.viewpoints[bent.middle]), std::pair(&far, bent.viewpoints.front())})
    for (Contact& contact : *contacts) {
      contact.source = contact.target = at + 0.2 * contact.source;
      contact.gradient.tail<3>() = contact.source.cross(Eigen::Vector3d(contact.gradient.head<3>()));
    }
  const auto at_middle = [&](const std::vector<Contact>& contacts) {
    const Pose3 T_middle_submap{Eigen::Quaterniond::Identity(), -bent.viewpoints[bent.middle]};
    const Matrix6d Ad = adjoint(T_middle_submap);
    return Matrix6d(Ad * bend_covariance(bent, bent, {}, contacts) * Ad.transpose());
  };
  EXPECT_LT(at_middle(near).trace(), 0.7 * at_middle(far).trace());
}

}  // namespace bend_test
}  // namespace tutti::lidar
