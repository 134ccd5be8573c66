// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/perception/fit/misfit.hpp"

namespace tutti::mission {

/// In words of the mission: times from its begin, and the setting to paste where one mends it.
MisfitRecord record_of(const fit::Misfit& misfit, const MissionRecording& recording);

/// Adds what a robot found: a kind once, as it was said last; each standstill of odometry.
void note_misfit(const fit::Misfit& misfit, std::vector<fit::Misfit>& all);

}  // namespace tutti::mission
