// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>

#include "tutti/robot/submap_builder.hpp"

namespace tutti::robot {

Status SubmapBuilder::hear(const RobotRange& range) {
  const auto where = [&] { return fmt::format("robot {}: range at {} ns", chain_.robot.value, range.stamp.ns); };
  if (auto ok = check_range(range); !ok) return in_context(where(), ok.error());
  if (range.to == chain_.robot)
    return fail(ErrorCode::invalid, "{}: to robot {} itself, expected another robot", where(), range.to.value);
  const auto before = std::ranges::find(state_.ranges.rbegin(), state_.ranges.rend(), range.to, &RobotRange::to);
  const bool is_close = before != state_.ranges.rend() && range.stamp - before->stamp < kFinestRange_s;
  if (is_close || state_.ranges.size() >= kMostRanges) return {};
  state_.ranges.push_back(range);
  state_.ranges.back().name.clear();
  return {};
}

/// Those until the open submap's last keyframe. Where they were measured the server knows by the keyframes around them.
std::vector<RobotRange> SubmapBuilder::take_ranges() {
  const Timestamp last = state_.keyframes.back().stamp;
  const auto later =
      std::ranges::stable_partition(state_.ranges, [&](const RobotRange& range) { return range.stamp <= last; });
  std::vector<RobotRange> rest(later.begin(), later.end());
  state_.ranges.erase(later.begin(), later.end());
  return std::exchange(state_.ranges, std::move(rest));
}

}  // namespace tutti::robot
