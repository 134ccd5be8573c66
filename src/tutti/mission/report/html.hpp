// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "tutti/mission/record.hpp"

namespace tutti::mission {

/// The whole report as one page: no script, no fonts, nothing fetched; plots are inline SVG; follows the reader's light
/// or dark setting. Contains wall-clock figures, so unlike report.json it differs from run to run.
std::string report_html(const MissionRecord& record);

}  // namespace tutti::mission
