// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tutti/mission/record.hpp"
#include "tutti/mission/recordings.hpp"
#include "tutti/perception/fit/misfit.hpp"

namespace tutti::mission {

/// How scans are to be taken where the misfit is one of clock or pose; nothing for others.
std::optional<MissionRecording::ScanSetup> corrected_setup(const fit::Misfit& misfit,
                                                           const MissionRecording::ScanSetup& stated);
/// ": --set .." of that, for the end of a sentence; empty where nothing can be set.
std::string to_paste(const fit::Misfit& misfit, const MissionRecording& recording);

/// In words of the mission: times from its begin, and the setting to paste where one mends it.
MisfitRecord record_of(const fit::Misfit& misfit, const MissionRecording& recording);

/// The whole sentence.
std::string warning_of(const std::string& robot, const MisfitRecord& misfit);

/// Adds what a robot found: a kind once, as it was said last; each standstill of odometry.
void note_misfit(const fit::Misfit& misfit, std::vector<fit::Misfit>& all);

}  // namespace tutti::mission
