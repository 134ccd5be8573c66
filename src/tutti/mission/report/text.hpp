// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/mission/record.hpp"

namespace tutti::mission {

/// What `tutti run` and `tutti demo` print last: plain ASCII, at most 100 columns (robot and policy names up to 12
/// characters), ends with the path of the page. `report_html_path` is printed as given.
std::string report_text(const MissionRecord& record, const std::string& report_html_path);

}  // namespace tutti::mission
