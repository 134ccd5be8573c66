// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include "tutti/mission/record.hpp"

/// What the files of a report are called.
namespace tutti::mission {

/// "alpha_server.tum"; characters of the name other than letters, digits, '-' and '_' become '_'.
std::string trajectory_file_name(const std::string& robot, const std::string& estimate);

/// All that write_report() writes of this record; of a mission with clouds also the pictures of the map, which are left
/// out when there is nothing to be seen.
std::vector<std::string> report_file_names(const MissionRecord& record);

/// A name that report_file_names() could give for some record.
bool is_report_file_name(const std::string& name);

}  // namespace tutti::mission
