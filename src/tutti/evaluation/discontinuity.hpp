// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include "tutti/model/trajectory.hpp"

namespace tutti::evaluation {

/// The largest change of a short motion by a correction. It needs no reference: a good correction bends odometry
/// gently, wherever it bends it to. Over pairs i, j of poses, j being the next pose after i and also the first one at
/// least `delta_s` later (left out where it is later than (1 + kMaxOvershoot) delta_s, a gap): with R the raw and C the
/// corrected estimate, R_ij = R_i^-1 R_j and C_ij likewise, the largest |t(C_ij) - t(R_ij)| and the largest angle of
/// rot(R_ij)^T rot(C_ij).
struct Discontinuity {
  double translation_m = 0.0;
  double rotation_deg = 0.0;
  Timestamp translation_at;  ///< Stamp of pose i of the pair with the largest change.
  Timestamp rotation_at;
};

/// Compares the poses of equal stamps; delta_s > 0. No value with fewer than two stamps in common.
std::optional<Discontinuity> discontinuity(const Trajectory& raw, const Trajectory& corrected, double delta_s = 1.0);

}  // namespace tutti::evaluation
