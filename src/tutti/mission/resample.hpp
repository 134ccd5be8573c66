// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::mission {

std::vector<Timestamp> stamps_of(const Trajectory& trajectory);

/// Replaces a recording's odometry by samples at `rate_hz`, from `phase_s` after its first sample on; the first and the
/// last sample stay. Poses are interpolated, and each step's covariance is that of the old steps in proportion to time.
/// Scans and images keep their stamps, which need not be those of odometry. Fails when fewer than two samples are left.
Status resample(Recording& recording, double rate_hz, double phase_s);

}  // namespace tutti::mission
