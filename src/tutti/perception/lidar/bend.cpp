// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/lidar/bend.hpp"

#include <Eigen/LU>

#include "tutti/geometry/symmetric.hpp"
#include "tutti/perception/lidar/submap_middle.hpp"

namespace tutti::lidar {
namespace {

constexpr double kNearest_m = 0.5;  // sensors see nothing nearer, and voxels are not smaller

/// Per keyframe, sum of w_k(p) g g^T over the contacts; `side`: which of their points is this submap's.
std::vector<Matrix6d> information_by_keyframe(const Bend& bend, std::span<const Contact> contacts,
                                              Eigen::Vector3d Contact::*side) {
  const std::size_t n = bend.viewpoints.size();
  std::vector<Matrix6d> out(n, Matrix6d::Zero());
  std::vector<double> share(n);
  for (const Contact& contact : contacts) {
    double sum = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
      const double squared_m = (bend.viewpoints[k] - contact.*side).squaredNorm();
      share[k] = 1.0 / (squared_m + kNearest_m * kNearest_m);
      sum += share[k];
    }
    const Matrix6d information = contact.weight / sum * contact.gradient * contact.gradient.transpose();
    for (std::size_t k = 0; k < n; ++k) out[k] += share[k] * information;
  }
  return out;
}

/// `moved`: from twists in the submap's frame to right perturbations of the registration.
Matrix6d covariance_of(const Bend& bend, const std::vector<Matrix6d>& by_keyframe, const Matrix6d& inverse_information,
                       const Matrix6d& moved) {
  Matrix6d covariance = Matrix6d::Zero(), beyond = Matrix6d::Zero();
  const auto add = [&](std::size_t step) {
    const Matrix6d effect = inverse_information * beyond * moved;
    covariance += effect * bend.steps[step] * effect.transpose();
  };
  for (std::size_t step = 0; step < bend.middle; ++step) {
    beyond += by_keyframe[step];
    add(step);
  }
  beyond.setZero();
  for (std::size_t step = bend.steps.size(); step-- > bend.middle;) {
    beyond += by_keyframe[step + 1];
    add(step);
  }
  return covariance;
}

}  // namespace

Bend find_bend(const Submap& submap) {
  Bend bend{.middle = find_middle(submap).index};
  const Pose3 T_submap_odom = submap.keyframes.front().T_odom_body.inverse();
  for (const Keyframe& keyframe : submap.keyframes) {
    const Pose3 T_submap_keyframe = T_submap_odom * keyframe.T_odom_body;
    bend.viewpoints.push_back(T_submap_keyframe.translation);
    if (bend.viewpoints.size() == 1) continue;
    // A step's error lives in the frame of its end.
    const Matrix6d Ad = adjoint(T_submap_keyframe);
    bend.steps.push_back(Ad * submap.odometry[bend.steps.size()].covariance * Ad.transpose());
  }
  return bend;
}

Matrix6d bend_covariance(const Bend& target, const Bend& source, const Pose3& T_target_source,
                         std::span<const Contact> contacts) {
  Matrix6d information = Matrix6d::Zero();
  double weights = 0.0;
  for (const Contact& contact : contacts) {
    information += contact.weight * contact.gradient * contact.gradient.transpose();
    weights += contact.weight;
  }
  // Damped as the registration is: what nothing constrains stays where it is.
  const Matrix6d inverse = inverse_of(information + 1e-6 * weights * Matrix6d::Identity());
  return covariance_of(source, information_by_keyframe(source, contacts, &Contact::source), inverse,
                       Matrix6d::Identity()) +
         covariance_of(target, information_by_keyframe(target, contacts, &Contact::target), inverse,
                       adjoint(T_target_source.inverse()));
}

}  // namespace tutti::lidar
