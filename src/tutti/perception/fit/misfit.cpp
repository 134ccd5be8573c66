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

/// The words for a sensor: its data, its mounting, and the settings that are about it.
struct Words {
  const char *seen, *is, *sits, *hangs, *pose, *offset, *signs, *lie, *why_still, *mend_still, *mend_scale;
};
constexpr std::array<Words, 2> kWords{{
    {.seen = "scans",
     .is = "its LiDAR is",
     .sits = "its LiDAR sits",
     .hangs = "the LiDAR hangs head down",
     .pose = "T_body_lidar",
     .offset = "scan_time_offset_s",
     .signs = ", or the points' y has the wrong sign",
     .lie = "lie on each other as they are",
     .why_still = "they are in the world's frame already, or are all one scan",
     .mend_still = "take the cloud in the LiDAR's or body's frame (FAST-LIO: /cloud_registered_body)",
     .mend_scale = "check wheel radius, or the camera's baseline or scale"},
    {.seen = "images",
     .is = "its cameras are",
     .sits = "its cameras sit",
     .hangs = "the cameras hang head down",
     .pose = "T_body_camera",
     .offset = "images.time_offset_s",
     .signs = "",
     .lie = "show no motion",
     .why_still = "they are all one image",
     .mend_still = "look at what takes the images",
     .mend_scale = "check the baseline between the cameras, the unit of depth images, or odometry's scale"},
}};
const Words& words(const Misfit& misfit) { return kWords[static_cast<std::size_t>(misfit.by)]; }

std::string read_otherwise(const Misfit& misfit, const char* as_what) {
  return fmt::format("its odometry fits the {} when it is read as {}", words(misfit).seen, as_what);
}

std::string mend_bridge(const Misfit&) {
  return "mend what writes the odometry (docs/frames.md: x forward, y left, z up)";
}

const std::array<Row, 15> kRows{{
    {MisfitKind::clock, "clock",
     [](const Misfit& m) {
       return fmt::format("its {} are stamped {:.3f} s {} by its odometry (sigma {:.3f} s)", words(m).seen,
                          std::abs(m.value), m.value < 0.0 ? "late" : "early", m.sigma);
     },
     [](const Misfit& m) { return fmt::format("add {:.3f} to {}", m.value, words(m).offset); }},
    {MisfitKind::turned, "turned",
     [](const Misfit& m) {
       return fmt::format("{} turned by {:.1f} degrees (sigma {:.1f}) against {} as stated", words(m).is, m.value,
                          m.sigma, words(m).pose);
     },
     [](const Misfit& m) { return fmt::format("turn {} by {}", words(m).pose, in_degrees(m.T_correction.rotation)); }},
    {MisfitKind::upside_down, "upside_down",
     [](const Misfit& m) {
       return fmt::format(
           "its {} and odometry are upside down or mirrored to each other: {}, odometry is of NED axes or a body of x "
           "forward, y right, z down{}",
           words(m).seen, words(m).hangs, words(m).signs);
     },
     [](const Misfit& m) {
       return fmt::format("if {}, turn {} by {}; else mend what writes the odometry or the {}", words(m).hangs,
                          words(m).pose, in_degrees(m.T_correction.rotation), words(m).seen);
     }},
    {MisfitKind::displaced, "displaced",
     [](const Misfit& m) {
       return fmt::format("{} {:.2f} m (sigma {:.2f} m) off from where {} states it", words(m).sits, m.value, m.sigma,
                          words(m).pose);
     },
     [](const Misfit& m) {
       const Eigen::Vector3d& t = m.T_correction.translation;
       return fmt::format("add ({:.2f}, {:.2f}, {:.2f}) m to {}'s translation", t.x(), t.y(), t.z(), words(m).pose);
     }},
    {MisfitKind::positions_ned, "positions_ned",
     [](const Misfit& m) {
       return read_otherwise(m, "positions north, east, down beside attitudes of x forward, z up");
     },
     mend_bridge},
    {MisfitKind::inverse_poses, "inverse_poses",
     [](const Misfit& m) { return read_otherwise(m, "the inverse of every pose"); }, mend_bridge},
    {MisfitKind::inverse_attitudes, "inverse_attitudes",
     [](const Misfit& m) { return read_otherwise(m, "positions with inverse rotations"); }, mend_bridge},
    {MisfitKind::w_first, "w_first",
     [](const Misfit& m) { return read_otherwise(m, "quaternions that were written w first"); },
     [](const Misfit&) { return std::string("write quaternions as x, y, z, w"); }},
    {MisfitKind::w_last, "w_last",
     [](const Misfit& m) { return read_otherwise(m, "quaternions that were written w last and are sent w first"); },
     [](const Misfit&) { return std::string("write quaternions as x, y, z, w"); }},
    {MisfitKind::scans_stand_still, "scans_stand_still",
     [](const Misfit& m) {
       return fmt::format("its {} {} while odometry moves by {:.0f} m: {}, or odometry runs away", words(m).seen,
                          words(m).lie, m.value, words(m).why_still);
     },
     [](const Misfit& m) { return std::string(words(m).mend_still); }},
    {MisfitKind::far_points, "far_points",
     [](const Misfit& m) {
       return fmt::format("half of its points are more than {:.0f} m away: not in metres", m.value);
     },
     [](const Misfit&) { return std::string("write points in metres"); }},
    {MisfitKind::scale, "scale",
     [](const Misfit& m) {
       return fmt::format("its odometry's distances are {:.3f} times those of its {} (sigma {:.3f})", 1.0 / m.value,
                          words(m).seen, m.sigma);
     },
     [](const Misfit& m) { return std::string(words(m).mend_scale); }},
    {MisfitKind::drift, "drift",
     [](const Misfit& m) {
       return fmt::format("its odometry turns {:.2f} degrees too far to the {} with every metre (sigma {:.2f})",
                          std::abs(m.value), m.value > 0.0 ? "left" : "right", m.sigma);
     },
     [](const Misfit&) { return std::string("check the gyroscope's bias, or the wheels' track width and radii"); }},
    {MisfitKind::stood_still, "stood_still",
     [](const Misfit& m) {
       return fmt::format("its odometry stood still for {:.1f} s while its {} moved by {:.1f} m and {:.0f} degrees",
                          m.to - m.from, words(m).seen, m.value, m.angle_deg);
     },
     [](const Misfit&) { return std::string("look at what makes the odometry at that time"); }},
    {MisfitKind::unexplained, "unexplained",
     [](const Misfit& m) {
       return fmt::format(
           "its {} contradict its odometry in {:.0f} % of the steps, and no mistake that is looked for explains it",
           words(m).seen, 100.0 * m.value);
     },
     [](const Misfit& m) {
       return fmt::format("check stamps, axes and units of odometry and {}, and that both are of one robot",
                          words(m).seen);
     }},
}};

const Row& row_of(MisfitKind kind) { return kRows[static_cast<std::size_t>(kind)]; }

}  // namespace

bool are_one(const Misfit& a, const Misfit& b) {
  if (a.kind != b.kind) return false;
  return a.kind == MisfitKind::stood_still ? a.from <= b.to && b.from <= a.to : a.by == b.by;
}

std::string_view to_string(MisfitKind kind) { return row_of(kind).name; }
std::optional<MisfitKind> misfit_kind(std::string_view name) {
  for (const Row& row : kRows)
    if (row.name == name) return row.kind;
  return std::nullopt;
}
std::string_view to_string(Witness witness) { return kWords[static_cast<std::size_t>(witness)].seen; }
std::string to_string(const Misfit& misfit) { return row_of(misfit.kind).says(misfit); }
std::string way_on(const Misfit& misfit) { return row_of(misfit.kind).way_on(misfit); }

}  // namespace tutti::fit
