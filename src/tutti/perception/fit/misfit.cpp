// SPDX-License-Identifier: BSD-3-Clause
#include "tutti/perception/fit/misfit.hpp"

#include <fmt/core.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "tutti/geometry/so3.hpp"

namespace tutti::fit {
namespace {

/// A kind of contradiction in words. `says` and `way_on` get the number; there is none to put in where they have no {}.
struct Row {
  MisfitKind kind;
  std::string_view name;
  std::string (*says)(const Misfit&);
  std::string (*way_on)(const Misfit&);
};

std::string in_degrees(const Eigen::Quaterniond& R) {
  const Eigen::Vector3d deg = so3_log(R) / kRadPerDeg;
  return fmt::format("({:.1f}, {:.1f}, {:.1f}) degrees about the body's x, y, z", deg.x(), deg.y(), deg.z());
}

std::string read_otherwise(const char* as_what) {
  return fmt::format("its odometry fits the scans when it is read as {}", as_what);
}

std::string mend_bridge(const Misfit&) {
  return "mend what writes the odometry (docs/frames.md: x forward, y left, z up)";
}

const std::array<Row, 15> kRows{{
    {MisfitKind::clock, "clock",
     [](const Misfit& m) {
       return fmt::format("its scans are stamped {:.3f} s {} by its odometry (sigma {:.3f} s)", std::abs(m.value),
                          m.value < 0.0 ? "late" : "early", m.sigma);
     },
     [](const Misfit& m) { return fmt::format("add {:.3f} to scan_time_offset_s", m.value); }},
    {MisfitKind::turned, "turned",
     [](const Misfit& m) {
       return fmt::format("its LiDAR is turned by {:.1f} degrees (sigma {:.1f}) against T_body_lidar as stated",
                          m.value, m.sigma);
     },
     [](const Misfit& m) { return fmt::format("turn T_body_lidar by {}", in_degrees(m.T_correction.rotation)); }},
    {MisfitKind::upside_down, "upside_down",
     [](const Misfit&) {
       return std::string(
           "its scans and odometry are upside down or mirrored to each other: the LiDAR hangs head down, "
           "odometry is of NED axes or a body of x forward, y right, z down, or the points' y has the "
           "wrong sign");
     },
     [](const Misfit& m) {
       return fmt::format(
           "if the LiDAR hangs head down, turn T_body_lidar by {}; else mend what writes the odometry or "
           "the cloud",
           in_degrees(m.T_correction.rotation));
     }},
    {MisfitKind::displaced, "displaced",
     [](const Misfit& m) {
       return fmt::format("its LiDAR sits {:.2f} m (sigma {:.2f} m) off from where T_body_lidar states it", m.value,
                          m.sigma);
     },
     [](const Misfit& m) {
       const Eigen::Vector3d& t = m.T_correction.translation;
       return fmt::format("add ({:.2f}, {:.2f}, {:.2f}) m to T_body_lidar's translation", t.x(), t.y(), t.z());
     }},
    {MisfitKind::positions_ned, "positions_ned",
     [](const Misfit&) { return read_otherwise("positions north, east, down beside attitudes of x forward, z up"); },
     mend_bridge},
    {MisfitKind::inverse_poses, "inverse_poses",
     [](const Misfit&) { return read_otherwise("the inverse of every pose"); }, mend_bridge},
    {MisfitKind::inverse_attitudes, "inverse_attitudes",
     [](const Misfit&) { return read_otherwise("positions with inverse rotations"); }, mend_bridge},
    {MisfitKind::w_first, "w_first",
     [](const Misfit&) { return read_otherwise("quaternions that were written w first"); },
     [](const Misfit&) { return std::string("write quaternions as x, y, z, w"); }},
    {MisfitKind::w_last, "w_last",
     [](const Misfit&) { return read_otherwise("quaternions that were written w last and are sent w first"); },
     [](const Misfit&) { return std::string("write quaternions as x, y, z, w"); }},
    {MisfitKind::scans_stand_still, "scans_stand_still",
     [](const Misfit& m) {
       return fmt::format(
           "its scans lie on each other as they are while odometry moves by {:.0f} m: they are in the "
           "world's frame already, or are all one scan, or odometry runs away",
           m.value);
     },
     [](const Misfit&) {
       return std::string("take the cloud in the LiDAR's or body's frame (FAST-LIO: /cloud_registered_body)");
     }},
    {MisfitKind::far_points, "far_points",
     [](const Misfit& m) {
       return fmt::format("half of its points are more than {:.0f} m away: not in metres", m.value);
     },
     [](const Misfit&) { return std::string("write points in metres"); }},
    {MisfitKind::scale, "scale",
     [](const Misfit& m) {
       return fmt::format("its odometry's distances are {:.3f} times those of its scans (sigma {:.3f})", 1.0 / m.value,
                          m.sigma);
     },
     [](const Misfit&) { return std::string("check wheel radius, or the camera's baseline or scale"); }},
    {MisfitKind::drift, "drift",
     [](const Misfit& m) {
       return fmt::format("its odometry turns {:.2f} degrees too far to the {} with every metre (sigma {:.2f})",
                          std::abs(m.value), m.value > 0.0 ? "left" : "right", m.sigma);
     },
     [](const Misfit&) { return std::string("check the gyroscope's bias, or the wheels' track width and radii"); }},
    {MisfitKind::stood_still, "stood_still",
     [](const Misfit& m) {
       return fmt::format("its odometry stood still for {:.1f} s while its scans moved by {:.1f} m and {:.0f} degrees",
                          m.to - m.from, m.value, m.angle_deg);
     },
     [](const Misfit&) { return std::string("look at what makes the odometry at that time"); }},
    {MisfitKind::unexplained, "unexplained",
     [](const Misfit& m) {
       return fmt::format(
           "its scans contradict its odometry in {:.0f} % of the steps, and no mistake that is looked for "
           "explains it",
           100.0 * m.value);
     },
     [](const Misfit&) {
       return std::string("check stamps, axes and units of odometry and cloud, and that both are of one robot");
     }},
}};

const Row& row_of(MisfitKind kind) { return kRows[static_cast<std::size_t>(kind)]; }

}  // namespace

std::string_view to_string(MisfitKind kind) { return row_of(kind).name; }
std::optional<MisfitKind> misfit_kind(std::string_view name) {
  for (const Row& row : kRows)
    if (row.name == name) return row.kind;
  return std::nullopt;
}
std::string to_string(const Misfit& misfit) { return row_of(misfit.kind).says(misfit); }
std::string way_on(const Misfit& misfit) { return row_of(misfit.kind).way_on(misfit); }

}  // namespace tutti::fit
