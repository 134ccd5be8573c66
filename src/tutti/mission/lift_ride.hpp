// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/mission/kidnapped.hpp"

namespace tutti::mission {

/// The recording of a robot that takes a lift: the first half of one, kRide_s in a closed lift, and the second half of
/// another, of another floor. Odometry stands while the lift moves; the reference has nothing there.
/// Samples but odometry, the reference and scans are left out. Fails for a recording without scans, or one of a few
/// samples.
Result<KidnappedRecording> ride_lift(const Recording& before, const Recording& after);
inline constexpr double kRide_s = 20.0;

}  // namespace tutti::mission
