// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/base/check.hpp"
#include "tutti/perception/lidar/submap_middle.hpp"
#include "tutti/perception/lidar/verify.hpp"

namespace tutti::lidar {
ClosureVerdict to_verdict(const Submap& a, const Submap& b, const PairVerification& verification) {
  TUTTI_CHECK(!a.keyframes.empty() && !b.keyframes.empty() && a.id != b.id);
  if (b.id < a.id) return to_verdict(b, a, inverse(verification));
  ClosureVerdict verdict{.pair = {a.id, b.id}, .refusal = verification.refusal};
  if (!verification.accepted) return verdict;
  const Middle from = find_middle(a), to = find_middle(b);
  LoopClosure closure{.from = {a.id.chain, a.keyframes[from.index].index},
                      .to = {b.id.chain, b.keyframes[to.index].index}};
  closure.measurement.T_a_b = from.T_submap_keyframe.inverse() * verification.T_a_b * to.T_submap_keyframe;
  const Matrix6d Ad = adjoint(to.T_submap_keyframe.inverse());
  closure.measurement.covariance = Ad * verification.covariance * Ad.transpose();
  verdict.closures.push_back(closure);
  verdict.evidence = verification.evidence;
  return verdict;
}

}  // namespace tutti::lidar
