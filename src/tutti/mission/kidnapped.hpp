// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "tutti/base/result.hpp"
#include "tutti/model/recording.hpp"

namespace tutti::mission {

/// A recording of a robot that is carried now and then, which its odometry does not notice.
struct KidnappedRecording {
  Recording recording;
  std::vector<Timestamp> at;  ///< Stamps of the last samples before each.
};

/// The recording without kCarried_s of every `every_s`, and without what it drove in them: odometry goes on from where
/// it was, the reference and scans are where they were. Where that would move the robot by less than kLeastCarried_m it
/// is carried later. Samples but odometry, the reference and scans are left out. Fails for a recording without scans,
/// and for one that is too short for one kidnap.
Result<KidnappedRecording> kidnapped(const Recording& recording, double every_s);
inline constexpr double kCarried_s = 20.0, kLeastCarried_m = 5.0;

}  // namespace tutti::mission
