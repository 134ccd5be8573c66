// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tutti/consistency/explanation.hpp"
#include "tutti/mission/report/geometry.hpp"
#include "tutti/model/recording.hpp"

/// Shows an explanation in words; used by missions' reports and by `tutti compare`.
namespace tutti::mission {

/// The largest significance over nodes, scales and directions; 0 without nodes.
double largest_significance(const consistency::Explanation& explanation);

/// Seconds, as on the axes of pictures: "712.3 s".
std::string format_time_s(double value_s);
/// Such as "0.41 m, 1.30 deg over 12.0 m".
std::string format_origin_size(const consistency::SuspectedOrigin& origin);
/// Where, when, how large and at which scale: "62.0 s - 72.0 s, at (12.3, -4.0, 0.2) m: 0.41 m, 1.30 deg over 12.0 m
/// (scale 16 m)"; without an explanation the scale is left out.
std::string format_origin(const consistency::SuspectedOrigin& origin, const PictureClock& clock,
                          const std::optional<consistency::Explanation>& explanation);
/// Such as "(12.3, -4.0, 0.2) m".
std::string format_place(const Eigen::Vector3d& place_m);
/// Such as "0.10 m, 20.3 deg".
std::string format_motion_error(double translation_m, double rotation_rad);
/// A sentence such as "odometry and map differ by up to 12 x the threshold", with the segment that odometry misses most
/// if there is one; or that they agree.
std::string format_disagreement(const consistency::Explanation& explanation);
/// The same for a robot's last update, of which the explanation must exist; or that there was nothing to compare with,
/// when the map of this robot is its own odometry.
std::string format_comparison(const MissionRecord& record, const RobotRecord& robot);
/// The scale of an origin as a length: "16 m"; "-" when the explanation does not have that scale.
std::string format_scale(const consistency::Explanation& explanation, int scale);
/// Such as "62.0 s - 72.0 s".
std::string format_between(const PictureClock& clock, Timestamp from, Timestamp until);
/// Such as "3.1 x".
std::string format_significance(double significance);

}  // namespace tutti::mission
