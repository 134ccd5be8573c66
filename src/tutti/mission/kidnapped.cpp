// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/mission/kidnapped.hpp"

#include <algorithm>
#include <memory>
#include <optional>
#include <utility>

#include "tutti/mission/chosen_scans.hpp"
#include "tutti/mission/resample.hpp"

namespace tutti::mission {
namespace {

/// The robot is carried in it, by the recording's clock: what is after `from` and before `to` is left out.
struct Gap {
  Timestamp from, to;
  [[nodiscard]] double length_s() const { return to - from; }
};

/// The stamp as if the gaps had not been; nothing within one. The first sample after a gap comes one step later.
std::optional<Timestamp> closed_up(Timestamp stamp, const std::vector<Gap>& gaps, double step_s) {
  double before_s = 0.0;
  for (const Gap& gap : gaps) {
    if (stamp <= gap.from) break;
    if (stamp < gap.to) return std::nullopt;
    before_s += gap.length_s() - step_s;
  }
  return stamp - before_s;
}

std::vector<Gap> find_gaps(const Trajectory& odometry, double every_s) {
  std::vector<Gap> out;
  Timestamp driven_since = odometry.front().stamp;
  for (std::size_t k = 0; k < odometry.size(); ++k) {
    if (odometry[k].stamp - driven_since < every_s) continue;
    const auto after = std::ranges::lower_bound(odometry, odometry[k].stamp + kCarried_s, {}, &StampedPose::stamp);
    if (after == odometry.end()) break;
    if ((after->pose.translation - odometry[k].pose.translation).norm() < kLeastCarried_m) continue;
    out.push_back({odometry[k].stamp, after->stamp});
    driven_since = after->stamp;
    k = static_cast<std::size_t>(after - odometry.begin());
  }
  return out;
}

Trajectory odometry_without(const std::vector<Gap>& gaps, double step_s, const Recording& from, Recording& out) {
  Trajectory odometry;
  Pose3 T_new_old;
  bool was_left_out = false;
  for (std::size_t k = 0; k < from.odometry.size(); ++k) {
    const StampedPose& sample = from.odometry[k];
    const auto stamp = closed_up(sample.stamp, gaps, step_s);
    if (!stamp) {
      was_left_out = true;
      continue;
    }
    if (was_left_out) T_new_old = odometry.back().pose * sample.pose.inverse();
    if (!odometry.empty() && k - 1 < from.increment_covariance.size())
      out.increment_covariance.push_back(from.increment_covariance[k - 1]);
    odometry.push_back({*stamp, T_new_old * sample.pose});
    was_left_out = false;
  }
  return odometry;
}

}  // namespace

Result<KidnappedRecording> kidnapped(const Recording& recording, double every_s) {
  const Trajectory& odometry = recording.odometry;
  if (recording.scans == nullptr || odometry.size() < 2)
    return fail(ErrorCode::invalid, "{}: no scans, expected a robot with LiDAR to kidnap", recording.name);
  const std::vector<Gap> gaps = find_gaps(odometry, every_s);
  if (gaps.empty())
    return fail(ErrorCode::invalid, "{}: {:.0f} s long, expected more than {:g} + {:g} s to kidnap it once",
                recording.name, odometry.back().stamp - odometry.front().stamp, every_s, kCarried_s);
  const double step_s = typical_gap_s(stamps_of(odometry));
  KidnappedRecording out;
  out.recording.robot = recording.robot;
  out.recording.name = recording.name;
  out.recording.odometry = odometry_without(gaps, step_s, recording, out.recording);
  for (const Gap& gap : gaps) out.at.push_back(*closed_up(gap.from, gaps, step_s));
  for (const StampedPose& pose : recording.reference)
    if (const auto stamp = closed_up(pose.stamp, gaps, step_s)) out.recording.reference.push_back({*stamp, pose.pose});
  std::vector<ChosenScans::Which> rest;
  for (std::size_t k = 0; const auto stamp = stamp_at(recording, recording.scan_stamps, k); ++k)
    if (const auto at = closed_up(*stamp, gaps, step_s)) rest.push_back({recording.scans, k, *at});
  set_scans(std::move(rest), out.recording);
  return out;
}

}  // namespace tutti::mission
