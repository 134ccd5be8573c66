// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>

#include "tutti/model/nearest_stamp.hpp"
#include "tutti/model/pose_at.hpp"
#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {

/// The fixes whose times odometry now covers.
void SubmapBuilder::place_fixes() {
  std::vector<PositionFix>& waiting = state_.waiting_fixes;
  const auto later = std::ranges::upper_bound(waiting, state_.recent.back().stamp, {}, &PositionFix::stamp);
  for (auto fix = waiting.begin(); fix != later; ++fix)
    if (const auto T_odom_body = pose_at(state_.recent, fix->stamp))
      state_.fixes.push_back({fix->stamp, *T_odom_body * fix->p_body_antenna, fix->antenna, fix->covariance});
  waiting.erase(waiting.begin(), later);
}

Status SubmapBuilder::hear(const PositionFix& fix) {
  const auto where = [&] { return fmt::format("robot {}: fix at {} ns", chain_.robot.value, fix.stamp.ns); };
  if (auto ok = check_fix(fix.antenna, fix.covariance, fix.p_body_antenna); !ok) return in_context(where(), ok.error());
  if (state_.heard_fix && fix.stamp - *state_.heard_fix < kFinestFix_s) return {};
  state_.heard_fix = fix.stamp;
  state_.waiting_fixes.push_back(fix);
  place_fixes();
  return {};
}

/// Those until the open submap's last keyframe, seen from its keyframes.
std::vector<SubmapFix> SubmapBuilder::take_fixes() {
  std::vector<SubmapFix> out;
  const std::vector<Keyframe>& keyframes = state_.keyframes;
  const auto later = std::ranges::upper_bound(state_.fixes, keyframes.back().stamp, {}, &PlacedFix::stamp);
  for (auto fix = state_.fixes.begin(); fix != later; ++fix) {
    const auto at = nearest_in_time(keyframes, fix->stamp, std::numeric_limits<double>::infinity(), &Keyframe::stamp);
    const Eigen::Vector3d p = at->T_odom_body.inverse() * fix->p_odom_antenna;
    if (p.norm() <= kFarthestAntenna_m) out.push_back({at->index, p, fix->antenna, fix->covariance});
  }
  state_.fixes.erase(state_.fixes.begin(), later);
  const std::size_t every = (out.size() + kMostFixes - 1) / kMostFixes;
  for (std::size_t i = 0; every > 1 && i * every < out.size(); ++i) out[i] = out[i * every];
  if (every > 1) out.resize((out.size() + every - 1) / every);
  return out;
}

}  // namespace tutti::robot
