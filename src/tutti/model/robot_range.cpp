// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/model/robot_range.hpp"

#include "tutti/base/plain_name.hpp"
#include "tutti/base/plain_text.hpp"
#include "tutti/model/position_fix.hpp"

namespace tutti {

Status check_range(const RobotRange& range) {
  constexpr std::size_t kLongestName = 64;
  if (!range.name.empty() && !is_plain_name(range.name, kLongestName))
    return fail(ErrorCode::invalid, "to '{}', expected a robot's name: 1 to {} letters, digits, '_' and '-'",
                plain_text(range.name, kLongestName), kLongestName);
  if (!(range.distance_m >= 0.0 && range.distance_m <= kFarthestRange_m))
    return fail(ErrorCode::invalid, "distance {} m, expected 0 to {:g} m", range.distance_m, kFarthestRange_m);
  if (range.sigma_m != 0.0 && !(range.sigma_m >= kLeastRangeSigma_m && range.sigma_m <= kLargestRangeSigma_m))
    return fail(ErrorCode::invalid, "sigma {} m, expected {:g} to {:g} m, or 0 where it is not known", range.sigma_m,
                kLeastRangeSigma_m, kLargestRangeSigma_m);
  if (!(range.p_body_antenna.norm() <= kFarthestAntenna_m))
    return fail(ErrorCode::invalid, "antenna {} m from the body, expected at most {} m", range.p_body_antenna.norm(),
                kFarthestAntenna_m);
  return {};
}

}  // namespace tutti
