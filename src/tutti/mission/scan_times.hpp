// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/base/timestamp.hpp"
#include "tutti/formats/pcd.hpp"
#include "tutti/mission/mission_config.hpp"
#include "tutti/robot/submap_builder.hpp"

/// When the points of a recorded sweep were measured. Files say it in one of four units, since the sweep's begin, until
/// its end or by a clock; a sweep is short, so the numbers show which.
namespace tutti::mission {

/// Within one scan; the shortest that tells units a thousand times apart.
inline constexpr double kShortestSweep_s = 0.001;
inline constexpr double kLongestSweep_s = robot::SubmapBuilder::kSweepHistoryS;
/// No point is measured farther from its pose than this, before or after it.
inline constexpr double kLongestAge_s = 1.0;

/// What the numbers of a file's time field mean.
struct PointTimes {
  enum class Zero { sweep_begin, sweep_end, odometry_clock, message, unknown };
  std::string field;
  std::string unit;  ///< s, ms, us or ns
  double unit_s = 1.0;
  Zero zero = Zero::unknown;
  bool pose_at_begin =
      false;  ///< The odometry pose is of the sweep's begin, not its end; odometry_clock and message say it themselves.
};

/// Judged by one scan, `stamp` being that of its odometry pose. Nothing: the robot's scans are taken as deskewed.
/// Error: the robot's settings want times that are not there, or the numbers are no sweep's.
Result<std::optional<PointTimes>> find_point_times(const formats::TimedCloud& scan, Timestamp stamp,
                                                   const RobotConfig& robot);
/// The same of a message, whose points say when they were measured after (or before) its stamp, or by its clock: so
/// ROS's drivers have it, and scan_pose_at does not matter.
Result<std::optional<PointTimes>> find_message_times(const formats::TimedCloud& scan, Timestamp stamp,
                                                     const RobotConfig& robot);

/// Seconds from each point's measurement to `stamp`, negative after it. Error: the times are not those of one sweep
/// about that stamp.
Result<std::vector<float>> point_ages(const formats::TimedCloud& scan, Timestamp stamp, const PointTimes& times);

/// For the report's notes: "scans are ...".
std::string in_words(const std::optional<PointTimes>& times);

}  // namespace tutti::mission
