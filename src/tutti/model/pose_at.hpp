// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <optional>
#include <span>

#include "tutti/model/trajectory.hpp"

namespace tutti {

/// The pose at a moment: that of a sample, or interpolated between two at most `max_gap_s` apart; nothing elsewhere.
std::optional<Pose3> pose_at(std::span<const StampedPose> trajectory, Timestamp stamp,
                             double max_gap_s = std::numeric_limits<double>::infinity());

}  // namespace tutti
