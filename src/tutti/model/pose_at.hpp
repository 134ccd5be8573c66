// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <optional>
#include <span>

#include "tutti/model/trajectory.hpp"

namespace tutti {

/// The pose at `stamp`: a sample's, or interpolated between the two neighbouring samples when these are at most
/// `max_gap_s` apart; else nothing. Logarithmic in the number of samples.
std::optional<Pose3> pose_at(std::span<const StampedPose> trajectory, Timestamp stamp,
                             double max_gap_s = std::numeric_limits<double>::infinity());

}  // namespace tutti
