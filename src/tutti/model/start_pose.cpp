// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/start_pose.hpp"

#include <cmath>

#include "tutti/geometry/covariance.hpp"

namespace tutti {

Status check_start_pose(const StartPose& start) {
  constexpr double kFar_m = 1e6, kUnit = 1e-3;
  if (!start.T_world_body) return {};
  const Pose3& T = start.T_world_body->T_a_b;
  if (!(T.translation.cwiseAbs().maxCoeff() <= kFar_m))
    return fail(ErrorCode::invalid, "a start pose at {}, {}, {} m, expected numbers within {} m of the map's origin",
                T.translation.x(), T.translation.y(), T.translation.z(), kFar_m);
  if (!(std::abs(T.rotation.norm() - 1.0) <= kUnit))
    return fail(ErrorCode::invalid, "a start pose whose quaternion has norm {}, expected 1", T.rotation.norm());
  if (const Status ok = check_covariance(start.T_world_body->covariance); !ok)
    return in_context("a start pose", ok.error());
  return {};
}

}  // namespace tutti
