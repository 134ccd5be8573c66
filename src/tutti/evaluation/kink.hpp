// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// The most that a correction changes short motions by, over pairs i, j of poses: j is the next pose after i, and the
/// first at least `delta_s` later (left out where that overshoots by more than half, a gap). With R the raw and C the
/// corrected estimate, R_ij = R_i^-1 R_j and C_ij likewise: |t(C_ij) - t(R_ij)| and the angle of rot(R_ij)^T rot(C_ij).
/// No reference is in it: a good correction bends odometry gently, whatever it bends it to.
struct Kink {
  double translation_m = 0.0;
  double rotation_deg = 0.0;
  Timestamp translation_at;  ///< Stamp of pose i of the pair with the largest change.
  Timestamp rotation_at;
};

/// Poses pair up where their stamps are equal; delta_s > 0. Nothing with fewer than two common poses.
std::optional<Kink> kink(const Trajectory& raw, const Trajectory& corrected, double delta_s = 1.0);

}  // namespace tutti::evaluation
