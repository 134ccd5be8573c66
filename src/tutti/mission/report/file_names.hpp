// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/mission/record.hpp"

/// The names of a report's files.
namespace tutti::mission {

/// Such as "alpha_server.tum"; characters of the robot's name other than letters, digits, '-' and '_' become '_'.
std::string trajectory_file_name(const std::string& robot, const std::string& estimate);

/// All files that write_report() writes for this record. For missions with clouds this includes the pictures of the
/// map, which are not written when there is nothing to see.
std::vector<std::string> report_file_names(const MissionRecord& record);

/// True if report_file_names() could give this name for some record.
bool is_report_file_name(const std::string& name);

}  // namespace tutti::mission
