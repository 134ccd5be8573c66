// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "tutti/base/result.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// The recording with odometry at `rate_hz`, from `phase_s` after its first sample on, and with its first and its last
/// sample: poses interpolated, each increment's covariance that of the old ones in proportion to time. Scans and images
/// keep their stamps, which it need not meet. An error: fewer than two samples are left.
Status resample(Recording& recording, double rate_hz, double phase_s);

}  // namespace tutti::mission
