// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "tutti/base/timestamp.hpp"
#include "tutti/geometry/pose3.hpp"

namespace tutti::fit {

/// The ways in which a robot's scans or images can contradict its odometry.
enum class MisfitKind : std::uint8_t {
  clock,              ///< Scans and odometry are stamped by clocks that differ.
  turned,             ///< The LiDAR is turned against the pose that is stated for it.
  upside_down,        ///< Turned by half a turn about a horizontal axis, or mirrored: a drive in the plane cannot tell.
  displaced,          ///< The LiDAR is somewhere else on the body than stated.
  positions_ned,      ///< Positions are north, east, down beside attitudes of x forward, z up.
  inverse_poses,      ///< Odometry has the inverse of every pose.
  inverse_attitudes,  ///< Positions are right, rotations are the inverse.
  w_first,            ///< Quaternions were written w first and are read w last.
  w_last,             ///< The other way round.
  scans_stand_still,  ///< Scans lie on each other as they are while odometry moves.
  far_points,         ///< Points are so far away that they cannot be in metres.
  scale,              ///< Odometry's metres are longer or shorter than those of the scans.
  drift,              ///< Odometry turns too far, in proportion to the distance.
  stood_still,        ///< Odometry stood still for a while, and scans moved.
  unexplained,        ///< Most steps contradict, and none of the above explains it.
};

/// Whose motion contradicts odometry's.
enum class Witness : std::uint8_t { scans, images };

/// One such contradiction, with its size. All that is said of scans and the LiDAR holds for images and cameras alike.
struct Misfit {
  MisfitKind kind = MisfitKind::clock;
  /// clock: added to the scans' stamps it gives odometry's time, s. turned: angle, degrees. displaced: m. scale: factor
  /// on odometry's translations that fits the scans. drift: degrees per metre that odometry turns too far to the left.
  /// scans_stand_still: m of odometry. far_points: median range. stood_still: m of the scans. unexplained: share of the
  /// steps.
  double value = 0.0;
  double sigma = 0.0;  ///< The value's; 0 where there is none.
  /// turned, upside_down, displaced: the pose of the LiDAR is T_correction * (the stated one).
  Pose3 T_correction;
  double angle_deg = 0.0;  ///< stood_still: rotation of the scans.
  Timestamp from, to;      ///< The steps that say so.
  Witness by = Witness::scans;
  template <class V>
  void describe(V& v) {
    v.field(1, "kind", kind);
    v.field(2, "value", value);
    v.field(3, "sigma", sigma);
    v.field(4, "correction", T_correction);
    v.field(5, "angle_deg", angle_deg);
    v.field(6, "from", from);
    v.field(7, "to", to);
    v.field(8, "by", by);
  }
};

/// Whether both are about one mistake, of whatever size: of one kind and by one witness. Odometry that stood still is
/// one where the times meet, whoever says so.
bool are_one(const Misfit& a, const Misfit& b);

/// Its name in logs and JSON, as "clock"; and back, nothing for what is none.
std::string_view to_string(MisfitKind kind);
std::optional<MisfitKind> misfit_kind(std::string_view name);
std::string_view to_string(Witness witness);
/// Says what is wrong and by how much, as a sentence's end: "its scans are stamped 0.598 s late by its odometry (sigma
/// ..)".
std::string to_string(const Misfit& misfit);
/// Says what to do about it.
std::string way_on(const Misfit& misfit);

}  // namespace tutti::fit
