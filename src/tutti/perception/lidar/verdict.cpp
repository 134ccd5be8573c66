// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>

#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/verify.hpp"

namespace tutti::lidar {
namespace {

/// The keyframe in the middle of a submap, where the rigid fit of a bent submap is best, and its uncertainty against
/// the submap's cloud as a whole. The middle by count: keyframes come with new views, which is what the cloud is made
/// of. With 0.3 deg/m of drift the median error there is 6.4 cm, half way by distance 7.4 cm, by time 8.3 cm.
struct Middle {
  std::size_t index = 0;
  Pose3 T_submap_keyframe;
  Matrix6d covariance = Matrix6d::Zero();  ///< Of the keyframe against the cloud, right perturbation.
};

Pose3 pose_in_submap(const Submap& submap, std::size_t k) {
  return submap.keyframes.front().T_odom_body.inverse() * submap.keyframes[k].T_odom_body;
}

/// The shared surfaces may have been seen from any keyframe k, so the odometry from the middle to k is part of the
/// error: mean over k of its covariance. A step counts for every keyframe beyond it.
Middle find_middle(const Submap& submap) {
  TUTTI_CHECK(submap.odometry.size() + 1 == submap.keyframes.size(), "{} odometry steps between {} keyframes",
              submap.odometry.size(), submap.keyframes.size());
  const std::size_t n = submap.keyframes.size(), m = (n - 1) / 2;
  Middle middle{.index = m, .T_submap_keyframe = pose_in_submap(submap, m)};
  for (std::size_t step = 0; step + 1 < n; ++step) {
    const std::size_t beyond = step < m ? step + 1 : n - 1 - step;
    // The step's error lives in the frame of its end, keyframe step + 1.
    const Matrix6d Ad = adjoint(middle.T_submap_keyframe.inverse() * pose_in_submap(submap, step + 1));
    middle.covariance +=
        static_cast<double>(beyond) / static_cast<double>(n) * Ad * submap.odometry[step].covariance * Ad.transpose();
  }
  return middle;
}

}  // namespace

ClosureVerdict to_verdict(const Submap& a, const Submap& b, const PairVerification& verification) {
  TUTTI_CHECK(!a.keyframes.empty() && !b.keyframes.empty() && a.id != b.id);
  if (b.id < a.id) return to_verdict(b, a, inverse(verification));
  ClosureVerdict verdict{.pair = {a.id, b.id}};
  if (!verification.accepted) {
    verdict.reason = verification.reason;
    return verdict;
  }
  const Middle from = find_middle(a), to = find_middle(b);
  // T_from_to = T_a_from^-1 T_a_b T_b_to: the errors of all three, in the frame of `to`.
  const Matrix6d Ad_b = adjoint(to.T_submap_keyframe.inverse());
  LoopClosure closure{.from = {a.id.robot, a.keyframes[from.index].index},
                      .to = {b.id.robot, b.keyframes[to.index].index}};
  closure.measurement.T_a_b = from.T_submap_keyframe.inverse() * verification.T_a_b * to.T_submap_keyframe;
  const Matrix6d Ad_from = adjoint(closure.measurement.T_a_b.inverse());
  closure.measurement.covariance = Ad_b * verification.covariance * Ad_b.transpose() +
                                   Ad_from * from.covariance * Ad_from.transpose() + to.covariance;
  verdict.closures.push_back(closure);
  return verdict;
}

}  // namespace tutti::lidar
