// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/formats/pcd.hpp"

/// Finds out when the points of a recorded sweep were measured. Files give times in one of four units, and since the
/// sweep's begin, until its end or by a clock, without saying which; but a sweep is short, so the numbers show it.
namespace tutti::lidar {

/// Limits on a sweep's duration; they distinguish units that differ by a factor of a thousand.
inline constexpr double kShortestSweep_s = 0.001;
inline constexpr double kLongestSweep_s = 0.5;
/// No point is measured farther in time from its scan's pose than this, before or after it.
inline constexpr double kLongestAge_s = 1.0;

/// A mission file's settings of a robot's scans: robots[].scans_deskewed (auto, yes, no), scan_time_unit (auto, s, ms,
/// us, ns) and scan_pose_at (end, begin).
struct ScanTimesConfig {
  std::string deskewed = "auto";
  std::string unit = "auto";
  std::string pose_at = "end";
};

/// The meaning of the numbers in a file's time field.
struct PointTimes {
  enum class Zero { sweep_begin, sweep_end, odometry_clock, message, unknown };
  std::string field;
  std::string unit;  ///< s, ms, us or ns
  double unit_s = 1.0;
  Zero zero = Zero::unknown;
  std::size_t strays = 0;      ///< Points of the scan that was judged by that drop_stray_times() took out.
  bool pose_at_begin = false;  ///< The scan's odometry pose is of the sweep's begin, not its end; with odometry_clock
                               ///< and message the times give it.
};

/// Takes out of `scan` the points whose times are none of its sweep's, as some drivers write a few: those farther from
/// the middle 96 % of the times than these last. Returns how many; none in scans of under ten points, or where nearly
/// all times are the same.
std::size_t drop_stray_times(formats::TimedCloud& scan);

/// Finds what the times of a robot's scans mean, judged by one scan whose odometry pose is of `stamp`, without the
/// points that drop_stray_times() takes out of it. No value: the robot's scans are taken as deskewed. Errors: the
/// settings want times that are missing, or the numbers are not those of a sweep.
Result<std::optional<PointTimes>> find_point_times(formats::TimedCloud& scan, Timestamp stamp,
                                                   const ScanTimesConfig& config);
/// As find_point_times(), for a ROS message: drivers give times relative to the message's stamp, or by its clock, and
/// scan_pose_at does not matter.
Result<std::optional<PointTimes>> find_message_times(formats::TimedCloud& scan, Timestamp stamp,
                                                     const ScanTimesConfig& config);

/// Per point the seconds from its measurement to `stamp`, negative for points measured after it. Error: the times are
/// not those of one sweep around that stamp.
Result<std::vector<float>> point_ages(const formats::TimedCloud& scan, Timestamp stamp, const PointTimes& times);

/// A sentence for the report's notes: "scans are ...".
std::string in_words(const std::optional<PointTimes>& times);

}  // namespace tutti::lidar
