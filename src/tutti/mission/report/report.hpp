// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>

#include "tutti/base/result.hpp"
#include "tutti/mission/record.hpp"

/// What a mission leaves behind; docs/report.md describes every file and figure.
namespace tutti::mission {

/// Writes everything into `out_dir` (made when missing, files of the same name replaced, and what an earlier
/// report.json there lists as its own removed): report.json, timing.json, report.html, config.yaml, per robot
/// <name>_{onboard,corrected,server,reference}.tum where there are such poses, graph.g2o with graph_stamps.csv,
/// map.ply, map_top.png and map_section.png when there is a cloud, and survey.ply when there is a survey. In file
/// names, characters of a robot's name other than letters, digits, '-' and '_' become '_'.
Status write_report(const MissionRecord& record, const std::filesystem::path& out_dir);

/// report.json: the figures of a mission under stable keys. A function of the record without its timing: same seed,
/// same bytes. Not measured or not finite = null. Metres and seconds to 1e-6.
std::string report_json(const MissionRecord& record);
/// timing.json: what depends on this machine's clock.
std::string timing_json(const MissionRecord& record);

/// The whole report as one page: no script, no fonts, nothing fetched; plots are inline SVG; follows the reader's light
/// or dark setting. Contains wall-clock figures, so unlike report.json it differs from run to run.
std::string report_html(const MissionRecord& record);

/// What `tutti run` and `tutti demo` print last: plain ASCII, at most 100 columns (robot and policy names up to 12
/// characters), ends with the path of the page, printed as given.
std::string report_text(const MissionRecord& record, const std::string& report_html_path);

}  // namespace tutti::mission
